#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "tests/fuzz/target.hpp"

// Feeds a target the files of the folders named, each once: what fuzzing has found stays tested without a fuzzer.
int main(int argc, char** argv) {
  namespace fs = std::filesystem;
  std::vector<fs::path> files;
  for (int a = 1; a < argc; ++a) {
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(argv[a], error)) files.push_back(entry.path());
    if (error) {
      std::fprintf(stderr, "%s: %s\n", argv[a], error.message().c_str());
      return 1;
    }
  }
  std::ranges::sort(files);
  for (const fs::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    bytes.shrink_to_fit();  // so that a sanitizer sees the end
    LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  }
  std::printf("%zu inputs\n", files.size());
  return files.empty() ? 1 : 0;
}
