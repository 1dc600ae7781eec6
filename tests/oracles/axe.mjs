// Accessibility of the pages by axe-core, as a phone and a desk see them, light and dark:
//
//   npm install axe-core puppeteer-core && node tests/oracles/axe.mjs http://127.0.0.1:8766/ file:///tmp/report.html
//
// Exit code 1: a serious or critical fault. Chromium is looked for where Debian has it (STRAPD_CHROMIUM names another).
import { createRequire } from "node:module";
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const require = createRequire(pathToFileURL(process.cwd() + "/"));
const puppeteer = require("puppeteer-core");
const axe = readFileSync(require.resolve("axe-core/axe.min.js"), "utf8");
const browser = await puppeteer.launch({
  executablePath: process.env.STRAPD_CHROMIUM || "/usr/bin/chromium",
  args: ["--no-sandbox", "--disable-gpu"],
});
let faults = 0;
for (const url of process.argv.slice(2)) {
  for (const scheme of ["light", "dark"]) {
    for (const width of [1280, 390]) {
      const page = await browser.newPage();
      await page.setBypassCSP(true);
      await page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
      await page.setViewport({ width, height: 900 });
      await page.goto(url, { waitUntil: "load" });
      // Until something is drawn.
      await new Promise((resolve) => setTimeout(resolve, 5000));
      await page.evaluate(axe);
      const { passes, violations } = await page.evaluate(() => axe.run(document));
      for (const { impact, id, help, nodes } of violations) {
        faults += impact === "serious" || impact === "critical";
        console.log(`  ${impact} ${id}: ${help}: ${nodes.map((node) => node.target.join(" ")).join(", ")}`);
      }
      console.log(`${url} ${scheme} ${width} px: ${passes.length} rules hold, ${violations.length} do not`);
      await page.close();
    }
  }
}
await browser.close();
process.exitCode = faults > 0 ? 1 : 0;
