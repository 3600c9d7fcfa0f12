#include <algorithm>
#include <fstream>
#include <functional>
#include <regex>
#include <sstream>

#include "tests/tree/tree.hpp"

namespace hairnet::tree {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> kTops{"core", "schema", "server", "client", "tests", "deploy"};
// The first part of the path of a library's header. The rules name such a header as <part>; all other headers in angle
// brackets are the standard library's and the system's, and every folder may include those, except for kOutside.
const std::set<std::string> kLibraries{
    "Eigen",      "hwy",    "boost",   "openssl", "sodium",  "sodium.h", "flatbuffers",    "nanoflann.hpp", "tl",
    "CLI",        "EGL",    "GLES3",   "GLFW",    "imgui.h", "png.h",    "backends",       "spdlog",        "nlohmann",
    "prometheus", "toml++", "nghttp3", "ngtcp2",  "gnutls",  "draco",    "meshoptimizer.h"};
// Core and schema know no clock, thread or file, so that a simulation depends on its inputs alone. A folder there may
// include one of these headers only where its line in the rules names the header.
const std::set<std::string> kOutside{"chrono", "thread", "fstream", "iostream", "filesystem", "ctime"};

// The folder of the source file whose `line` imports from, relative to `root`; empty: the line imports no file of ours.
std::string folder_of_import(const fs::path& root, const fs::path& file, const std::string& line) {
  static const std::regex kImport(".*(?:from|import) ?\\(?\"(\\.[^\"]+)\".*");
  std::smatch match;
  if (!std::regex_match(line, match, kImport)) return {};
  return (file.parent_path() / match[1].str())
      .lexically_normal()
      .parent_path()
      .lexically_relative(root)
      .generic_string();
}

// Returns whether a file in the folder `from` may include `to`, which is a folder, or a library's header as <part>.
// Without a line in the rules a folder may include nothing, not even itself.
bool allows(const IncludeRules& rules, const std::string& from, const std::string& to) {
  const auto rule = rules.find(from);
  return rule != rules.end() && (from == to || rule->second.contains(to) || rule->second.contains("any"));
}

// Returns what is wrong with one #include of a file in `folder`, or an empty text. `name` is the text between the
// quotes (`quoted`) or the angle brackets.
std::string error_of(const fs::path& root, const IncludeRules& rules, const std::string& folder,
                     const std::string& name, bool quoted) {
  const std::string top = name.substr(0, name.find('/'));
  // Files of the tree. A generated header lies in the build folder, and not below `root`.
  if (quoted && kTops.contains(top)) {
    const std::string to = fs::path(name).parent_path().generic_string();
    if (!fs::exists(root / name) && !fs::exists(fs::path(HAIRNET_BINARY_DIR) / name)) return name + " does not exist";
    return allows(rules, folder, to) ? "" : folder + " may not include " + to;
  }
  if (kLibraries.contains(top))
    return allows(rules, folder, '<' + top + '>') ? "" : folder + " may not include <" + top + '>';
  // A quoted name that does not begin at the root of the tree is an error, since the rules could not find its folder.
  // Code that flatc generates is the exception.
  if (quoted && name.find("_generated.h") == std::string::npos)
    return '"' + name + "\" is not written from the root of the tree";
  const bool inner = folder.starts_with("core") || folder.starts_with("schema");
  return inner && kOutside.contains(top) && !allows(rules, folder, '<' + top + '>')
             ? folder + " may not include <" + top + '>'
             : "";
}

}  // namespace

IncludeRules parse_rules(std::string_view text) {
  IncludeRules rules;
  std::istringstream lines{std::string(text)};
  for (std::string line; std::getline(lines, line);) {
    line = line.substr(0, line.find('#'));
    const std::size_t colon = line.find(':');
    if (colon == std::string::npos) continue;
    std::istringstream words(line.substr(colon + 1));
    std::set<std::string>& to = rules[line.substr(0, colon)];
    for (std::string word; words >> word;) to.insert(word);
  }
  return rules;
}

std::string circle_of(const IncludeRules& rules) {
  // A depth-first search. `way` holds the folders from the beginning to the present one, and `done` the folders that
  // were visited before. A folder that is on the way a second time closes a circle.
  std::set<std::string> done;
  std::vector<std::string> way;
  std::function<std::string(const std::string&)> visit = [&](const std::string& folder) -> std::string {
    if (const auto at = std::find(way.begin(), way.end(), folder); at != way.end()) {
      std::string circle;
      for (auto it = at; it != way.end(); ++it) circle += *it + ' ';
      return circle + folder;
    }
    const auto rule = rules.find(folder);
    if (rule == rules.end() || !done.insert(folder).second) return {};
    way.push_back(folder);
    for (const std::string& to : rule->second) {
      if (std::string circle = visit(to); !circle.empty()) return circle;
    }
    way.pop_back();
    return {};
  };
  for (const auto& [folder, to] : rules) {
    if (std::string circle = visit(folder); !circle.empty()) return circle;
  }
  return {};
}

std::vector<std::string> wrong_includes(const fs::path& root, const IncludeRules& rules) {
  static const std::regex kInclude("\\s*#\\s*include\\s*([<\"])([^>\"]+)[>\"].*");
  std::vector<std::string> errors;
  for (const std::string& top : kTops) {
    if (!fs::exists(root / top)) continue;
    for (auto it = fs::recursive_directory_iterator(root / top); it != fs::recursive_directory_iterator(); ++it) {
      if (it->path().filename() == "node_modules" || it->path().filename() == "generated")
        it.disable_recursion_pending();
      const std::string extension = it->path().extension().string();
      const std::string file = it->path().lexically_relative(root).generic_string();
      // The browser client's TypeScript is checked, too, but only its imports of relative paths.
      const bool is_script =
          extension == ".ts" && (file.starts_with("client/web/src/") || file.starts_with("client/web/page/"));
      if (extension != ".hpp" && extension != ".cpp" && !is_script) continue;
      const std::string folder = fs::path(file).parent_path().generic_string();
      if (!rules.contains(folder)) {
        errors.push_back(file + ": the folder has no line in the rules");
        continue;
      }
      std::ifstream source(it->path());
      std::size_t number = 0;
      for (std::string line; std::getline(source, line);) {
        ++number;
        if (is_script) {
          const std::string to = folder_of_import(root, it->path(), line);
          if (!to.empty() && !allows(rules, folder, to))
            errors.push_back(file + ':' + std::to_string(number) + ": " + folder + " may not import " + to);
          continue;
        }
        std::smatch match;
        if (line.find("include") == std::string::npos || !std::regex_match(line, match, kInclude)) continue;
        const std::string error = error_of(root, rules, folder, match[2], match[1] == "\"");
        if (!error.empty()) errors.push_back(file + ':' + std::to_string(number) + ": " + error);
      }
    }
  }
  return errors;
}

}  // namespace hairnet::tree
