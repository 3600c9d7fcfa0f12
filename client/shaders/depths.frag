#version 300 es
precision highp float;
precision highp sampler2D;

// Copies the depths of a picture to those of the screen.
uniform sampler2D depth;

void main() { gl_FragDepth = texelFetch(depth, ivec2(gl_FragCoord.xy), 0).x; }
