#include <algorithm>
#include <cctype>
#include <fstream>
#include <regex>

#include "tests/tree/tree.hpp"

namespace hairnet::tree {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> lines_of(const fs::path& path) {
  std::vector<std::string> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

// A heading's anchor, as GitHub makes it: lower case, spaces to dashes, no punctuation.
std::string anchor_of(const std::string& heading) {
  std::string anchor;
  for (const char c : heading) {
    if (std::isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_')
      anchor += static_cast<char>(std::tolower(c));
    if (c == ' ') anchor += '-';
  }
  return anchor;
}

bool has_anchor(const fs::path& page, const std::string& anchor) {
  const std::vector<std::string> lines = lines_of(page);
  return std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
    const std::size_t text = line.find_first_not_of('#');
    return text != 0 && text != std::string::npos && line[text] == ' ' && anchor_of(line.substr(text + 1)) == anchor;
  });
}

struct Tree {
  fs::path root;
  std::set<std::string> files;  // relative
  // Returns whether some file or folder is `name`, seen from the page's folder `from` or from the root, or as the end
  // of a path: a page may name `room.cpp` without its folder.
  [[nodiscard]] bool has(const fs::path& from, std::string name) const {
    while (name.ends_with('/')) name.pop_back();
    if (fs::exists(root / from / name) || fs::exists(root / name)) return true;
    return std::any_of(files.begin(), files.end(), [&](const std::string& f) {
      return ('/' + f).ends_with('/' + name) || ('/' + f).find('/' + name + '/') != std::string::npos;
    });
  }
};

}  // namespace

std::vector<std::string> broken_links(const fs::path& root, const std::set<std::string>& words) {
  // kLink finds the target of ](target), kCode the text in backquotes, kScheme an address such as https:..., and kPath
  // a file's name within such a text, by its extension.
  static const std::regex kLink("\\]\\(([^)\\s]+)\\)"), kCode("`([^`]+)`"), kScheme("[a-z]+:.*"),
      kPath("[\\w./-]*[\\w-]\\.(hpp|cpp|ts|mjs|md|fbs|glsl|vert|frag|cmake|toml|yml|jpg|webp|svg|csv|html)\\b");
  Tree tree{root, {}};
  std::vector<fs::path> pages;
  for (const auto& top : fs::directory_iterator(root)) {
    const std::string name = top.path().filename().string();
    if (name == "build" || name == ".git" || name == "demo") continue;
    if (!top.is_directory()) {
      tree.files.insert(name);
      if (top.path().extension() == ".md") pages.push_back(top.path());
      continue;
    }
    for (auto it = fs::recursive_directory_iterator(top); it != fs::recursive_directory_iterator(); ++it) {
      const std::string leaf = it->path().filename().string();
      if (leaf == "node_modules" || leaf.starts_with("dist")) it.disable_recursion_pending();
      if (!it->is_regular_file()) continue;
      tree.files.insert(it->path().lexically_relative(root).generic_string());
      if (it->path().extension() == ".md") pages.push_back(it->path());
    }
  }
  std::vector<std::string> errors;
  for (const fs::path& page : pages) {
    const fs::path folder = page.parent_path().lexically_relative(root);
    bool fenced = false;
    std::size_t number = 0;
    for (const std::string& line : lines_of(page)) {
      ++number;
      const auto error = [&](const std::string& what) {
        errors.push_back(page.lexically_relative(root).generic_string() + ':' + std::to_string(number) + ": " + what);
      };
      // Blocks of code are left out: they show commands and other programs' files.
      if (line.starts_with("```")) fenced = !fenced;
      if (fenced) continue;
      for (std::sregex_iterator it(line.begin(), line.end(), kLink), end; it != end; ++it) {
        const std::string link = (*it)[1];
        if (std::regex_match(link, kScheme)) continue;
        const std::string path = link.substr(0, link.find('#'));
        const fs::path target = path.empty() ? page : page.parent_path() / path;
        if (!fs::exists(target))
          error("no " + link);
        else if (link.find('#') != std::string::npos && !has_anchor(target, link.substr(link.find('#') + 1)))
          error("no heading " + link);
      }
      for (std::sregex_iterator it(line.begin(), line.end(), kCode), end; it != end; ++it) {
        const std::string code = (*it)[1];
        // Patterns such as `*.cpp` name no single file, and options such as `--config=x.toml` name a file of the
        // reader's.
        if (code.find('*') != std::string::npos || code.find("--") != std::string::npos) continue;
        for (std::sregex_iterator p(code.begin(), code.end(), kPath); p != end; ++p) {
          const std::string path = p->str();
          // Absolute paths and paths that leave the tree are those of other machines.
          if (!path.starts_with('/') && !path.starts_with("..") && !words.contains(path) && !tree.has(folder, path))
            error("no file " + path);
        }
      }
    }
  }
  return errors;
}

}  // namespace hairnet::tree
