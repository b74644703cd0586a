// Unpacks the page's own modules and the model's WebAssembly, all of which lie in this file; nothing is fetched.
const unpacked = async (id) => {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent), (char) => char.charCodeAt(0));
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
};
const lacking = ["WebAssembly", "DecompressionStream"].filter((name) => !(name in window));
const tell = (words) => {
  document.getElementById("trouble").hidden = false;
  document.getElementById("trouble").textContent = words;
};
if (lacking.length) tell(`This browser lacks ${lacking.join(" and ")}: the model cannot fly in it. A newer one can.`);
else
  (async () => {
    window.swashBytes = await unpacked("flight");
    const modules = JSON.parse(new TextDecoder().decode(await unpacked("modules"))), urls = {};
    for (const [name, text] of modules) {
      const named = text.replace(/(from\s*)"\.\/([^"]+)"/g, (_, from, other) => `${from}"${urls[other.replace("vendor/", "")]}"`);
      urls[name] = URL.createObjectURL(new Blob([named], { type: "text/javascript" }));
    }
    await import(urls["live.js"]);
  })().catch((error) => tell(`The model does not fly here: ${error.message}`));
