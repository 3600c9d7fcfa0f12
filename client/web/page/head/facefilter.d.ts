declare module "facefilter/dist/jeelizFaceFilter.moduleES6.js" {
  /** What of the library is used here. */
  export const JEELIZFACEFILTER: {
    init(options: {
      canvas: HTMLCanvasElement;
      NNC: string;
      videoSettings: { videoElement: HTMLVideoElement };
      followZRot: boolean;
      maxFacesDetected: number;
      callbackReady: (fault: string | false) => void;
      callbackTrack: (face: { detected: number; rx: number; ry: number; rz: number }) => void;
    }): void;
    toggle_pause(isPaused: boolean, stopsVideo: boolean): Promise<void>;
    update_videoElement(video: HTMLVideoElement, done: () => void): void;
  };
}
