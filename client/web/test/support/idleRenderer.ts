import type { WebGLRenderer } from "three";

const nothing = () => null;

/**
 * Stands for a WebGLRenderer with a canvas of 800 x 600 pixels and without float targets. It draws nothing, and is
 * enough for all that a scene does before the GPU has its turn.
 */
export const idleRenderer = {
  xr: { isPresenting: false },
  domElement: { addEventListener: nothing, removeEventListener: nothing },
  capabilities: { maxTextureSize: 4096 },
  extensions: { has: () => false },
  getContext: () => ({ getExtension: nothing, getParameter: nothing }),
  getDrawingBufferSize: (size: { set(x: number, y: number): unknown }) => size.set(800, 600),
  getRenderTarget: nothing,
  getActiveCubeFace: nothing,
  getActiveMipmapLevel: nothing,
  getClearColor: nothing,
  getClearAlpha: nothing,
  setRenderTarget: nothing,
  setClearColor: nothing,
  clear: nothing,
  render: nothing,
} as unknown as WebGLRenderer;
