import type { CDPSession, Page } from "playwright-core";
import { PNG } from "pngjs";
import { isWarm } from "./picture";

/**
 * The share of the width that is looked at. The panel beside it has samples of hair colours, which are as warm as hair.
 */
const kPictureShare = 0.7;
/** Hair is in the picture when it covers this share of all pixels. */
const kHairShare = 0.01;

/** Watches what the browser shows, whatever the page's own thread does meanwhile, until there is hair or skin. */
export class FirstSeen {
  /**
   * The time at which the first picture with hair or skin arrives in this process, a little after it was on the screen.
   * The browser reports only when pictures began.
   */
  readonly epochMs: Promise<number>;

  private constructor(session: CDPSession) {
    this.epochMs = new Promise((done) => {
      const onPicture = ({ sessionId, data }: { sessionId: number; data: string }) => {
        const isSeen = isHair(PNG.sync.read(Buffer.from(data, "base64")));
        if (isSeen) {
          session.off("Page.screencastFrame", onPicture);
          done(Date.now());
        }
        const answer = isSeen
          ? session.send("Page.stopScreencast")
          : session.send("Page.screencastFrameAck", { sessionId });
        // The page may be closed by the time the answer arrives.
        answer.catch(() => undefined);
      };
      session.on("Page.screencastFrame", onPicture);
    });
  }

  static async watch(page: Page): Promise<FirstSeen> {
    const session = await page.context().newCDPSession(page);
    const seen = new FirstSeen(session);
    await session.send("Page.startScreencast", { format: "png", maxWidth: 320, maxHeight: 180 });
    return seen;
  }
}

/** Whether hair or skin is in the picture: both are warm. */
function isHair({ data, width, height }: PNG): boolean {
  let warm = 0;
  for (let p = 0; p < data.length; p += 4) if ((p / 4) % width < kPictureShare * width && isWarm(data, p)) ++warm;
  return warm > kHairShare * width * height;
}
