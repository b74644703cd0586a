// Pages that users read come before those about how the program is made.
const BEHIND = { "decisions/": 0.2, "developers/": 0.3, "proof": 0.1 };
// eslint-disable-next-line no-unused-vars
var Scorer = {
  score: ([page, , , , score]) => {
    const key = Object.keys(BEHIND).find((start) => page.startsWith(start));
    return score * (key === undefined ? 1 : BEHIND[key]);
  },
  objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0,
  title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
