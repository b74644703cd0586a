// Unpacks the page's own modules, and a model's WebAssembly where there is one, all of which lie in this file; nothing is fetched.
const unpacked = async (id) => {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (char) => char.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
};
const packed = [...document.querySelectorAll('script[type="text/plain"]')].map((one) => one.id).filter((id) => id !== "modules");
const lacking = [packed.includes("flight") && "WebAssembly", "DecompressionStream"].filter((name) => name && !(name in window));
const tell = (words) => {
  document.getElementById("trouble").hidden = false;
  document.getElementById("trouble").textContent = words;
};
if (lacking.length) tell(`This browser lacks ${lacking.join(" and ")}: the page does not work in it. A newer one shows it.`);
else
  (async () => {
    window.swashBytes = Object.fromEntries(await Promise.all(packed.map(async (id) => [id, await unpacked(id)])));
    const modules = JSON.parse(new TextDecoder().decode(await unpacked("modules"))), urls = {};
    for (const [name, text] of modules) {
      const named = text.replace(/((?:from|import)\s*)"(\/[\w./-]+\.js)"/g, (_, word, other) => `${word}"${urls[other]}"`);
      urls[name] = URL.createObjectURL(new Blob([named], { type: "text/javascript" }));
    }
    await import(urls[modules.at(-1)[0]]);
  })().catch((error) => tell(`The page does not work here: ${error.message}`));
