#include <fstream>
#include <regex>

#include "tests/tree/tree.hpp"

namespace hairnet::tree {
namespace {

namespace fs = std::filesystem;

// The class, with those around it, whose member function the line begins to define outside of the class; empty: none.
std::string class_of_definition(const std::string& line) {
  static const std::regex kMember("^([^ #/][^(=;]*[ &*>])?(([A-Z]\\w*::)+)(~?\\w+|operator[^(]*)\\(.*");
  std::smatch match;
  if (line.find("::") == std::string::npos || !std::regex_match(line, match, kMember)) return {};
  const std::string scopes = match[2];
  return scopes.substr(0, scopes.size() - 2);
}

}  // namespace

std::vector<std::string> classes_in_several_files(const fs::path& root,
                                                  const std::map<std::string, std::string>& excused) {
  // Two classes of one name live in different folders.
  std::map<std::string, std::set<std::string>> files_of;
  for (const char* top : {"core", "schema", "server", "client", "tests"}) {
    if (!fs::exists(root / top)) continue;
    for (auto it = fs::recursive_directory_iterator(root / top); it != fs::recursive_directory_iterator(); ++it) {
      const fs::path path = it->path().lexically_relative(root);
      // The folder has TypeScript, and the packages of its tests.
      if (path == "client/web") it.disable_recursion_pending();
      if (path.extension() != ".cpp") continue;
      std::ifstream source(it->path());
      for (std::string line; std::getline(source, line);)
        if (const std::string name = class_of_definition(line); !name.empty())
          files_of[(path.parent_path() / name).generic_string()].insert(path.filename().string());
    }
  }
  std::vector<std::string> errors;
  for (const auto& [name, files] : files_of) {
    if (files.size() == 1 || excused.contains(name)) continue;
    std::string error = name + ": its member functions stand in";
    for (const std::string& file : files) error += ' ' + file;
    errors.push_back(error + "; put them in one file, or give a second noun a class of its own");
  }
  for (const auto& [name, reason] : excused)
    if (files_of[name].size() < 2) errors.push_back(name + ": is excused, but does not stand in several files");
  return errors;
}

}  // namespace hairnet::tree
