// Bundles the pinned libraries into the Python package, with their licences beside them: npm ci && npm run bundle
import { build } from "esbuild";
import { copyFileSync, mkdirSync, readFileSync, statSync, writeFileSync } from "node:fs";

const out = "../src/cornersmooth/page/assets/vendor";
const common = { bundle: true, minify: true, format: "iife", target: "es2022", legalComments: "inline" };

mkdirSync(out, { recursive: true });
await build({ ...common, entryPoints: ["three.js"], globalName: "THREE", outfile: `${out}/three.js` });
await build({
  ...common,
  stdin: { contents: 'import uPlot from "uplot"; globalThis.uPlot = uPlot;', resolveDir: "." },
  outfile: `${out}/uplot.js`,
});
copyFileSync("node_modules/uplot/dist/uPlot.min.css", `${out}/uplot.css`);
copyFileSync("node_modules/three/LICENSE", `${out}/three.LICENSE`);
copyFileSync("node_modules/uplot/LICENSE", `${out}/uplot.LICENSE`);

const version = (name) => JSON.parse(readFileSync(`node_modules/${name}/package.json`, "utf8")).version;
const versions = { three: version("three"), uplot: version("uplot") };
writeFileSync(`${out}/versions.json`, `${JSON.stringify(versions, null, 1)}\n`);
for (const name of ["three.js", "uplot.js", "uplot.css"]) {
  console.log(`${name} ${statSync(`${out}/${name}`).size} bytes`);
}
