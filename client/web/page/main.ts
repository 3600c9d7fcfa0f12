import { watchInputMeans } from "./inputMeans";
import { PageViewer } from "./viewer";
import { pageServer, readQuery } from "./query";
import { missingOf } from "./requirements";

watchInputMeans(document.documentElement);
const lack = missingOf(document.createElement("canvas"));
if (lack) {
  const error = document.querySelector<HTMLParagraphElement>("#error")!;
  error.textContent = lack;
  error.hidden = false;
  document.querySelector<HTMLElement>("#loading")!.hidden = true;
  document.querySelector<HTMLElement>("#state")!.dataset.state = "closed";
  document.querySelector<HTMLElement>("#state")!.textContent = "cannot draw";
} else {
  const viewer = new PageViewer(readQuery(new URL(location.href), pageServer(document)));
  void viewer.start();
  // For the browser console and the tests.
  Object.assign(window, { hairnet: viewer });
}
