#include <CLI/CLI.hpp>
#include <cstdio>
#include <span>
#include <string>

#include "client/files/write_file.hpp"
#include "tests/tools/codec_cases.hpp"

// Writes frames and their bytes as JSON, to test a decoder that is written in another language.
int main(int argc, char** argv) {
  CLI::App app("Writes frames and their bytes as JSON, to test a decoder in another language.",
               "hairnet-codec-vectors");
  std::string path;
  app.add_option("file", path, "to write")->required();
  CLI11_PARSE(app, argc, argv);
  const std::string text = nlohmann::ordered_json{{"cases", hairnet::codec::codec_cases()}}.dump() + "\n";
  if (const auto written = hairnet::write_file(path, std::as_bytes(std::span(text))); !written) {
    std::fprintf(stderr, "hairnet-codec-vectors: %s: %s\n", path.c_str(), written.error().c_str());
    return 1;
  }
  return 0;
}
