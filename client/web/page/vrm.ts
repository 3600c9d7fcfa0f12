import { makeMinimalVrm } from "./minimalVrm";
import { pageServer, readQuery } from "./query";
import { missingOf } from "./requirements";
import { VrmViewer } from "./vrmViewer";

const lack = missingOf(document.createElement("canvas"));
if (lack) {
  const fault = document.querySelector<HTMLParagraphElement>("#fault")!;
  fault.textContent = lack;
  fault.hidden = false;
} else {
  const viewer = new VrmViewer(readQuery(new URL(location.href), pageServer(document)));
  Object.assign(window, { hairnet: viewer });
  void viewer.start(makeMinimalVrm());
}
