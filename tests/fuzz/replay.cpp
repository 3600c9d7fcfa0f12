#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "tests/fuzz/target.hpp"
#include "tests/support/mutation.hpp"

namespace {

constexpr int kMutations = 200'000;
// Mutating ends after this time: a target whose inputs take long gets fewer.
constexpr std::chrono::seconds kMutating_max{3};

void feed(const std::vector<std::uint8_t>& bytes) {
  LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
}

}  // namespace

// Feeds a target the files of the folders named, each once, and then some thousand corrupted ones: what fuzzing has
// found stays tested without a fuzzer, and a little is searched around it.
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
  std::vector<std::vector<std::uint8_t>> inputs;
  for (const fs::path& path : files) {
    std::ifstream file(path, std::ios::binary);
    std::vector<std::uint8_t>& bytes =
        inputs.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
    // A sanitizer sees a read past the end only where the memory ends with the bytes.
    bytes.shrink_to_fit();
    feed(bytes);
  }
  std::erase_if(inputs, [](const auto& bytes) { return bytes.empty(); });
  if (inputs.empty()) {
    std::fprintf(stderr, "no inputs\n");
    return 1;
  }
  std::mt19937 random(1);
  const auto until = std::chrono::steady_clock::now() + kMutating_max;
  int mutations = 0;
  for (; mutations < kMutations && std::chrono::steady_clock::now() < until; ++mutations)
    feed(hairnet::wire::mutated(random, inputs[random() % inputs.size()]));
  std::printf("%zu inputs, %d corrupted\n", files.size(), mutations);
  return 0;
}
