import type { CDPSession, Page } from "playwright-core";
import { PNG } from "pngjs";

/**
 * The share of the width that is looked at. The panel beside it has samples of hair colours, which are as warm as hair.
 */
const kPictureShare = 0.7;
/** Hair is in the picture when it covers this share of all pixels. */
const kHairShare = 0.01;

/** Watches what the browser shows, whatever the page's own thread does meanwhile, until there is hair or skin. */
export class FirstSeen {
  /**
   * When the first picture that has it has arrived here: a moment after it was on the screen. The browser's own times
   * are those at which pictures began.
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

/** Whether hair or skin is in the picture: both are warm, which the backdrop's grey is not. */
function isHair({ data, width, height }: PNG): boolean {
  let warm = 0;
  for (let p = 0; p < data.length; p += 4)
    if ((p / 4) % width < kPictureShare * width && data[p] > data[p + 2] + 12) ++warm;
  return warm > kHairShare * width * height;
}
