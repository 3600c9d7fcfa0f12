import type { WebGLRenderer } from "three";

/**
 * Shows the button that enters and leaves immersive VR. Without a headset the button stays hidden. `onError` gets one
 * line when the headset refuses.
 */
export async function offerHeadset(
  button: HTMLButtonElement,
  renderer: WebGLRenderer,
  onError: (detail: string) => void,
): Promise<void> {
  const { xr } = navigator;
  if (!xr || !(await xr.isSessionSupported("immersive-vr").catch(() => false))) return;
  button.hidden = false;
  let session: XRSession | null = null;
  button.addEventListener("click", () => {
    if (session) return void session.end();
    xr.requestSession("immersive-vr", { optionalFeatures: ["local-floor", "hand-tracking"] })
      .then(async (started) => {
        session = started;
        started.addEventListener("end", () => {
          session = null;
          button.textContent = "Enter VR";
        });
        await renderer.xr.setSession(started);
        button.textContent = "Leave VR";
      })
      .catch((error: Error) => onError(`The headset refuses: ${error.message}`));
  });
}
