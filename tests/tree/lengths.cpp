#include <algorithm>
#include <fstream>
#include <iterator>

#include "tests/tree/tree.hpp"

namespace hairnet::tree {

namespace fs = std::filesystem;

std::vector<std::string> files_longer_than(std::size_t lines_max, const fs::path& root,
                                           const std::map<std::string, std::string>& excused) {
  static const std::set<std::string> kSources{".cpp", ".hpp", ".h", ".ts"};
  std::map<std::string, std::size_t> long_files;
  for (const char* top : {"core", "schema", "server", "client", "tests"}) {
    if (!fs::exists(root / top)) continue;
    for (auto it = fs::recursive_directory_iterator(root / top); it != fs::recursive_directory_iterator(); ++it) {
      const fs::path name = it->path().filename();
      if (name == "node_modules" || name == "generated" || name == "build") it.disable_recursion_pending();
      if (!kSources.contains(name.extension().string()) || !it->is_regular_file()) continue;
      std::ifstream source(it->path());
      const auto lines = std::count(std::istreambuf_iterator<char>(source), {}, '\n');
      if (lines > static_cast<std::ptrdiff_t>(lines_max))
        long_files[it->path().lexically_relative(root).generic_string()] = static_cast<std::size_t>(lines);
    }
  }
  std::vector<std::string> errors;
  for (const auto& [file, lines] : long_files)
    if (!excused.contains(file))
      errors.push_back(file + ": has " + std::to_string(lines) + " lines, of which " + std::to_string(lines_max) +
                       " are allowed; give a second noun a file of its own");
  for (const auto& [file, reason] : excused)
    if (!long_files.contains(file)) errors.push_back(file + ": is excused, but is not so long");
  return errors;
}

}  // namespace hairnet::tree
