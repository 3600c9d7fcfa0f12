#include <cctype>
#include <fstream>
#include <regex>

#include "tests/tree/tree.hpp"

namespace hairnet::tree {
namespace {

namespace fs = std::filesystem;

// The column at which a line's comment begins, outside of strings; npos: there is none.
std::size_t comment_column(const std::string& line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (quote != 0) {
      if (line[i] == '\\')
        ++i;
      else if (line[i] == quote)
        quote = 0;
      continue;
    }
    // An apostrophe within a number separates digits.
    const bool is_separator = line[i] == '\'' && i > 0 && std::isalnum(static_cast<unsigned char>(line[i - 1])) != 0;
    if (line[i] == '"' || (line[i] == '\'' && !is_separator)) quote = line[i];
    if (line.compare(i, 2, "//") == 0 || line.compare(i, 2, "/*") == 0) return i;
  }
  return std::string::npos;
}

}  // namespace

std::vector<std::string> comments_that_begin_with_a_preposition(const fs::path& root) {
  // The first class of characters is that of the markers of comments: //, /*, ///, //!, ///<.
  static const std::regex kFragment("^[/*!<]+ *(of|that|from|to) ");
  std::vector<std::string> errors;
  for (const char* top : {"core", "schema", "server", "client", "tests"}) {
    if (!fs::exists(root / top)) continue;
    for (auto it = fs::recursive_directory_iterator(root / top); it != fs::recursive_directory_iterator(); ++it) {
      if (it->path().filename() == "node_modules" || it->path().filename() == "generated")
        it.disable_recursion_pending();
      const std::string extension = it->path().extension().string();
      if (extension != ".hpp" && extension != ".cpp" && extension != ".h") continue;
      std::ifstream source(it->path());
      std::size_t number = 0, column_before = std::string::npos;
      for (std::string line; std::getline(source, line);) {
        ++number;
        const std::size_t column = comment_column(line);
        // A line of its own goes on with the comment that the line before has at its column.
        const bool goes_on = column == column_before && line.find_first_not_of(' ') == column;
        column_before = column;
        if (column == std::string::npos) continue;
        const std::string comment = line.substr(column);
        std::smatch match;
        if (std::regex_search(comment, match, kFragment) && !(goes_on && comment.starts_with("//")))
          errors.push_back(it->path().lexically_relative(root).generic_string() + ':' + std::to_string(number) +
                           ": the comment begins with \"" + match[1].str() +
                           "\"; write a sentence with a subject and a verb, on a line before the thing");
      }
    }
  }
  return errors;
}

}  // namespace hairnet::tree
