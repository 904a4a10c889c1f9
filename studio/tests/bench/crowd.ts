/** Ten thousand robots on a page, for the benchmarks. */

import { readFileSync } from "node:fs";
import type { Page } from "playwright-core";
import { drawn } from "../browser";

/** Opens a crowd: by its name from the made-up server, as a text that a real one runs. */
export async function openCrowd(page: Page, isReal: boolean): Promise<void> {
  if (!isReal) {
    await page.getByRole("button", { name: "crowd", exact: true }).first().click();
    return drawn(page);
  }
  await page.getByRole("button", { name: "robots", exact: true }).first().click();
  await drawn(page);
  await page.getByRole("tab", { name: "Text" }).click();
  const text = page.getByRole("textbox", { name: "Text of the scenario" });
  await text.click();
  await page.keyboard.press("Control+A");
  // Pasted, as a person would: typed lines get styles of the browser's own, which the page's policy forbids.
  await text.evaluate(
    (editor, crowd) => {
      const clipboardData = new DataTransfer();
      clipboardData.setData("text/plain", crowd);
      editor.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
    },
    readFileSync(new URL("crowd.toml", import.meta.url), "utf8"),
  );
  await page.getByTestId("check").filter({ hasText: "no problems" }).waitFor();
  await page.getByRole("button", { name: "Run", exact: true }).click();
  await page.locator("canvas.picture").waitFor();
}
