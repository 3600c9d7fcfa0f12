/** Everything of the package in one file, for `<script type="module">` with an import map for three. */
export * from "../inline";
export * from "../scene/index";
export * from "../vrm/index";
