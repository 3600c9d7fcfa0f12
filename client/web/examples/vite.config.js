// One development server for the examples that need one: npx vite, then http://localhost:5173/minimal/ and so on.
export default {
  esbuild: { jsx: "automatic" },
  // hairnet-client is linked from its folder, which has a three of its own.
  resolve: { dedupe: ["three", "@pixiv/three-vrm"] },
  // The other examples need no build.
  optimizeDeps: {
    // Vite would copy the package into one file with others, where it would not find its hairnet.wasm.
    exclude: ["hairnet-client"],
    entries: ["{minimal,vrm,react-three-fiber,babylon}/index.html"],
    // esbuild adds this to each .tsx file. If Vite found it late, it would load the page again.
    include: ["react/jsx-dev-runtime"],
  },
  server: { fs: { allow: ["../../.."] } },
};
