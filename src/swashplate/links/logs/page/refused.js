// An answer that refuses, with its words.
export class Refused extends Error {
  constructor({ problem, hint }) {
    super(problem);
    this.hint = hint ?? "";
  }
  get words() {
    return this.hint ? `${this.message}\n${this.hint}` : this.message;
  }
}
