#include "tests/tree/tree.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

namespace hairnet::tree {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
namespace fs = std::filesystem;

const fs::path kRoot = HAIRNET_SOURCE_DIR;

std::string text_of(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

IncludeRules rules() {
  return parse_rules(text_of(kRoot / "tests/tree/include_rules.txt"));
}

TEST(Includes, follow_the_rules) {
  EXPECT_THAT(wrong_includes(kRoot, rules()), IsEmpty());
}
TEST(Includes, have_rules_without_a_circle) {
  EXPECT_EQ(circle_of(rules()), "");
}

// A small tree in which errors are planted.
class Planted : public testing::Test {
 protected:
  void write(const fs::path& path, std::string_view text) {
    fs::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text;
  }
  void TearDown() override { fs::remove_all(root_); }
  fs::path root_ =
      fs::path(testing::TempDir()) / ("tree_" + std::to_string(::testing::UnitTest::GetInstance()->random_seed()) +
                                      testing::UnitTest::GetInstance()->current_test_info()->name());
};

TEST_F(Planted, wrong_include_is_found) {
  write("core/groom/groom.hpp", "#pragma once\n");
  write("core/pose/pose.hpp", "#pragma once\n#include \"core/groom/groom.hpp\"\n");
  EXPECT_THAT(wrong_includes(root_, parse_rules("core/groom:\ncore/pose:\n")),
              ElementsAre(HasSubstr("core/pose/pose.hpp:2: core/pose may not include core/groom")));
}
TEST_F(Planted, wrong_import_is_found) {
  write("client/web/src/hair/pose.ts", "import { Link } from \"../net/link\";\n");
  EXPECT_THAT(wrong_includes(root_, parse_rules("client/web/src/hair:\n")),
              ElementsAre(HasSubstr("client/web/src/hair may not import client/web/src/net")));
}
TEST_F(Planted, folder_without_a_rule_is_found) {
  write("core/extra/extra.hpp", "#pragma once\n");
  EXPECT_THAT(wrong_includes(root_, {}), ElementsAre(HasSubstr("no line in the rules")));
}
TEST_F(Planted, clock_in_core_is_found) {
  write("core/pose/pose.cpp", "#include <chrono>\n");
  EXPECT_THAT(wrong_includes(root_, parse_rules("core/pose:\n")), ElementsAre(HasSubstr("<chrono>")));
}
TEST_F(Planted, circle_of_rules_is_found) {
  EXPECT_EQ(circle_of(parse_rules("a: b\nb: c\nc: a\n")), "a b c a");
}

TEST(Pages, name_what_exists) {
  EXPECT_THAT(broken_links(kRoot, {"demo/sheet.png", "x.png", "OUT.json", "IN.txt", "from_web.json", "schema/enums.hpp",
                                   "schema/wire/message.hpp"}),
              IsEmpty());
}
TEST_F(Planted, broken_link_is_found) {
  write("README.md", "# A\n[b](b.md) [c](#nothing) `core/none.hpp` [a](#a)\n");
  EXPECT_THAT(broken_links(root_),
              ElementsAre(HasSubstr("no b.md"), HasSubstr("no heading #nothing"), HasSubstr("no file core/none.hpp")));
}

TEST(Comments, a_comment_does_not_begin_with_a_preposition) {
  EXPECT_THAT(comments_that_begin_with_a_preposition(kRoot), IsEmpty());
}
TEST_F(Planted, comment_that_begins_with_a_preposition_is_found) {
  write("core/pose/pose.hpp", "int size = 1'000;  // of a pose\n// of the head\n/* to the end */\n");
  EXPECT_THAT(comments_that_begin_with_a_preposition(root_),
              ElementsAre(HasSubstr("core/pose/pose.hpp:1: the comment begins with \"of\""),
                          HasSubstr("core/pose/pose.hpp:2: "), HasSubstr("core/pose/pose.hpp:3: ")));
}
TEST_F(Planted, comment_that_goes_on_with_a_preposition_is_not_found) {
  write("client/hairnet.h", "// Says the size\n// of a pose.\nchar c = '\"';  // off\nauto s = \"// of it\";\n");
  EXPECT_THAT(comments_that_begin_with_a_preposition(root_), IsEmpty());
}

// Classes may only stand in several files for a reason that is written here.
const std::map<std::string, std::string> kExcusedClasses{
    {"client/room/Room", "what it does about touch is compiled for size in the browser's module, all else for speed"},
    {"server/quic/Connection", "ngtcp2's callbacks stand beside the function that hands them over, with its settings"},
    {"server/session/Session", "the handler of each message is a class of its own that only on_message() knows"},
    {"server/tick/Scheduler", "commands come between ticks and change what ticks step; both need all of it"},
    {"tests/load/fleet_plan/Simulation", "servers, rooms and clients of a model change each other in each step"},
    {"tests/whole/Player", "the checks compare what arrives with all that the player has sent"},
    {"tests/whole/fleet_chaos/Chaos", "each action has its own check, and both act on the whole fleet"},
};

TEST(Classes, are_in_one_file) {
  EXPECT_THAT(classes_in_several_files(kRoot, kExcusedClasses), IsEmpty());
}
TEST_F(Planted, class_in_two_files_is_found) {
  write("server/room/room.cpp", "Room::Room() = default;\n");
  write("server/room/room_doors.cpp", "const std::vector<Door>& Room::doors(int floor) const {\n}\n");
  EXPECT_THAT(classes_in_several_files(root_, {}),
              ElementsAre(HasSubstr("server/room/Room: its member functions stand in room.cpp room_doors.cpp")));
  EXPECT_THAT(classes_in_several_files(root_, {{"server/room/Room", "a reason"}}), IsEmpty());
}
TEST_F(Planted, call_and_class_of_the_same_name_elsewhere_are_not_found) {
  write("server/room/room.cpp", "Room::~Room() {\n  Door::close(0);\n}\nbool Room::operator==(int) const {\n");
  write("server/room/door.cpp", "void Door::close(int) {\n  Room::count();\n}\nconst int Room::kMax = min(1);\n");
  write("client/room/room.cpp", "void Room::enter() {\n}\n");
  EXPECT_THAT(classes_in_several_files(root_, {}), IsEmpty());
}
TEST_F(Planted, excuse_without_a_class_is_found) {
  write("server/room/room.cpp", "Room::Room() = default;\n");
  EXPECT_THAT(classes_in_several_files(root_, {{"server/room/Room", "a reason"}}),
              ElementsAre(HasSubstr("server/room/Room: is excused")));
}

// Files may only be longer for a reason that is written here.
const std::map<std::string, std::string> kExcusedFiles{
    {"client/assets/import/usd_crate.cpp", "one binary format, whose parts refer to each other by number"},
    {"client/hairnet.h", "the manual of the C interface, which callers read from top to end"},
    {"client/link/link_core.cpp", "the protocol's one state machine: each message may change its state"},
};

TEST(Files, are_at_most_600_lines_long) {
  EXPECT_THAT(files_longer_than(600, kRoot, kExcusedFiles), IsEmpty());
}
TEST_F(Planted, file_that_is_too_long_is_found) {
  write("core/pose/pose.cpp", "\n\n\n\n");
  write("client/web/src/pose.ts", "\n\n\n");
  EXPECT_THAT(files_longer_than(3, root_, {}), ElementsAre(HasSubstr("core/pose/pose.cpp: has 4 lines")));
  EXPECT_THAT(files_longer_than(3, root_, {{"core/pose/pose.cpp", "a reason"}}), IsEmpty());
  EXPECT_THAT(files_longer_than(4, root_, {{"core/pose/pose.cpp", "a reason"}}),
              ElementsAre(HasSubstr("core/pose/pose.cpp: is excused")));
}

}  // namespace
}  // namespace hairnet::tree
