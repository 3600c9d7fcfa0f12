/** Describes in one line what this browser lacks, or returns null when it can draw hair. */
export function missingOf(canvas: HTMLCanvasElement): string | null {
  if (typeof WebSocket === "undefined") return "This browser has no WebSocket.";
  const gl = canvas.getContext("webgl2");
  if (!gl)
    return "This browser offers no WebGL 2, which drawing needs: switch on hardware acceleration, or use another browser.";
  const error = textureError(gl);
  // Browsers allow a page only a few contexts at a time, so this one is given back.
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return error;
}

function textureError(gl: WebGL2RenderingContext): string | null {
  // Earlier errors would be taken for the one of the texture below.
  while (gl.getError() !== gl.NO_ERROR);
  const texture = gl.createTexture();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 1, 1, 0, gl.RGBA, gl.FLOAT, new Float32Array(4));
  const refused = gl.getError() !== gl.NO_ERROR;
  gl.deleteTexture(texture);
  // Vertex shaders of hair read at least two textures: the records of characters, and the nodes of their lattices.
  if (refused || gl.getParameter(gl.MAX_VERTEX_TEXTURE_IMAGE_UNITS) < 2)
    return "This graphics driver reads no float textures in vertex shaders, which drawing needs.";
  return null;
}
