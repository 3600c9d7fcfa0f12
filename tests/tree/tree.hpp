#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

// Rules for the source tree itself: who includes whom, that pages name files that exist, that comments are sentences,
// that a class is in one file, and that no file is too long to read at a time.
namespace hairnet::tree {

// Which folder may include which: one line a folder, `FOLDER: FOLDER ... <library> ...`; `any` allows everything.
using IncludeRules = std::map<std::string, std::set<std::string>>;
IncludeRules parse_rules(std::string_view text);
// Folders that include each other in a circle by these rules, as "a b c"; empty: none.
std::string circle_of(const IncludeRules& rules);

// Each error is one line, `file:line: error`. Paths are relative to `root`; build outputs are left out.
std::vector<std::string> wrong_includes(const std::filesystem::path& root, const IncludeRules& rules);
// Looks through every *.md for relative links and anchors that lead nowhere, and `paths` in backquotes that name no
// file. `words` are names that look like files of the tree but are others' (demo/sheet.png, model.onnx).
std::vector<std::string> broken_links(const std::filesystem::path& root, const std::set<std::string>& words = {});
// Looks through the C and C++ files of core, schema, server, client and tests for comments that begin with a lower-case
// of, that, from or to. Such a comment is half a sentence, of which the line holds the other half.
std::vector<std::string> comments_that_begin_with_a_preposition(const std::filesystem::path& root);
// Looks through the same folders, without client/web, for classes whose member functions are defined in more than one
// .cpp file. `excused` are allowed to: `folder/Class` with a reason. An excuse that is not needed is an error, too.
std::vector<std::string> classes_in_several_files(const std::filesystem::path& root,
                                                  const std::map<std::string, std::string>& excused);
// Looks through the same folders and client/web for sources of more than `lines_max` lines. `excused` may be longer:
// files with a reason. An excuse that is not needed is an error, too.
std::vector<std::string> files_longer_than(std::size_t lines_max, const std::filesystem::path& root,
                                           const std::map<std::string, std::string>& excused);

}  // namespace hairnet::tree
