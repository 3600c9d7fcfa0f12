import qrcode from "qrcode-generator";

/** The link as a QR code: an SVG picture with its quiet zone. */
export function qrPicture(link: URL): SVGSVGElement {
  const code = qrcode(0, "M");
  code.addData(link.href);
  code.make();
  const holder = document.createElement("div");
  holder.innerHTML = code.createSvgTag({ cellSize: 4, margin: 16, scalable: true });
  const picture = holder.querySelector("svg")!;
  picture.role = "img";
  picture.setAttribute("aria-label", "QR code of the link");
  return picture;
}
