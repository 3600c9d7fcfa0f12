// One development server for the examples that need one: npx vite, then http://localhost:5173/minimal/ and so on.
export default {
  esbuild: { jsx: "automatic" },
  // hairnet-client is linked from its folder, which has a three of its own.
  resolve: { dedupe: ["three", "@pixiv/three-vrm"] },
  // The other examples need no build.
  optimizeDeps: {
    exclude: ["hairnet-client"], // copied into one file with others it would not find its hairnet.wasm
    entries: ["{minimal,vrm,react-three-fiber,babylon}/index.html"],
    include: ["react/jsx-dev-runtime"], // esbuild adds it to each .tsx: found late, it would reload the page
  },
  server: { fs: { allow: ["../../.."] } },
};
