// What the server is asked. An answer that refuses is thrown with its words.
import { Refused } from "./refused.js";

async function answer(response) {
  let told;
  try {
    told = await response.json();
  } catch {
    throw new Refused({ problem: `The server answered ${response.status}.`, hint: "" });
  }
  if (!response.ok) throw new Refused(told);
  return told;
}

async function asked(address, options) {
  let response;
  try {
    response = await fetch(address, options);
  } catch {
    throw new Refused({ problem: "The server does not answer.", hint: "Is swash open still running?" });
  }
  return answer(response);
}

export const get = (address) => asked(address);

const waiting = new Set(); // questions without an answer yet

export function post(address, fields) {
  const told = asked(address, { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(fields) });
  const over = () => waiting.delete(told);
  waiting.add(told);
  told.then(over, over);
  return told;
}

// Once all that is being asked now has its answer.
export const answered = () => Promise.allSettled([...waiting]);

// A file in pieces, one after the other; `progress` hears the share that is there.
export async function upload(file, piece, progress) {
  const { token } = await post("/upload", { name: file.name, size: file.size });
  let made = {};
  for (let at = 0; at < file.size; at += piece) {
    made = await asked(`/upload/${token}/${at}`, { method: "POST", body: file.slice(at, at + piece) });
    progress(Math.min(1, (at + piece) / file.size));
  }
  return made.log;
}
