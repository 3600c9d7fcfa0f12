#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "schema/wire/frame_datagram.hpp"
#include "schema/wire/messages.hpp"

// PROTOCOL.md is the contract with other clients. Its numbers, names and bytes must equal those of the code, so these
// tests read the page and the sources as text.
namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

using Row = std::vector<std::string>;

std::vector<std::string> lines_of(const std::string& path) {
  std::ifstream file(std::string(HAIRNET_SOURCE_DIR) + '/' + path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

std::string text_of(const std::string& path) {
  std::string text;
  for (const std::string& line : lines_of(path)) text += line + '\n';
  return text;
}

std::vector<std::string> page_lines() {
  return lines_of("schema/PROTOCOL.md");
}

std::vector<std::string> matches_of(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it) found.push_back((*it)[1]);
  return found;
}

// Returns what is between `opening` and the next closing brace of a schema or header.
std::string block_of(const std::string& path, const std::string& opening) {
  const std::string text = text_of(path);
  const std::size_t begin = text.find(opening);
  EXPECT_NE(begin, std::string::npos) << opening;
  return begin == std::string::npos ? "" : text.substr(begin, text.find('}', begin) - begin);
}

// Returns the rows of the table below the line that starts with `header`. The first cell of a row comes without its
// backquotes.
std::vector<Row> table_below(const std::string& header) {
  std::vector<Row> rows;
  bool is_below = false;
  // The number of the table's lines so far.
  std::size_t line_count = 0;
  for (const std::string& line : page_lines()) {
    is_below = is_below || line.rfind(header, 0) == 0;
    if (!is_below) continue;
    if (line.empty() || line.front() != '|') {
      if (line_count > 0) break;
      continue;
    }
    // The first two lines of a table are its header and a rule.
    if (++line_count < 3) continue;
    Row& row = rows.emplace_back();
    std::istringstream cells(line.substr(1));
    for (std::string cell; std::getline(cells, cell, '|');)
      row.push_back(cell.substr(1, std::max<std::size_t>(cell.size(), 2) - 2));
    std::erase(row.front(), '`');
  }
  EXPECT_FALSE(rows.empty()) << header;
  return rows;
}

// Returns the packets of the section "Vectors", in order.
std::vector<Bytes> vectors() {
  std::vector<Bytes> packets;
  bool in_section = false, in_block = false;
  for (const std::string& line : page_lines()) {
    if (line.rfind("## ", 0) == 0) in_section = line == "## Vectors";
    if (!in_section) continue;
    if (line == "```") {
      in_block = !in_block;
      if (in_block) packets.emplace_back();
    } else if (in_block) {
      std::istringstream hex(line);
      for (std::string byte; hex >> byte;)
        packets.back().push_back(static_cast<std::uint8_t>(std::stoi(byte, nullptr, 16)));
    }
  }
  return packets;
}

std::vector<std::string> values_of(const std::string& enum_name) {
  const std::string block = block_of("schema/enums.fbs", "enum " + enum_name + " ");
  return matches_of(block.substr(block.find('{')), "(\\w+)");
}

void expect_reasons_in_order(const std::string& enum_name, const std::vector<Row>& rows, std::size_t column_count) {
  const std::vector<std::string> reasons = values_of(enum_name);
  // The reason `none` is never sent, so the page does not have it.
  ASSERT_EQ(rows.size() + 1, reasons.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), column_count) << reasons[i + 1];
    EXPECT_EQ(rows[i].front(), reasons[i + 1]);
    EXPECT_GT(rows[i].back().size(), 3u) << reasons[i + 1];
  }
}

TEST(ProtocolPage, documents_every_error_in_order_and_what_to_do) {
  expect_reasons_in_order("ErrorReason", table_below("| error |"), 3);
}

TEST(ProtocolPage, documents_every_goodbye_in_order_and_what_to_do) {
  expect_reasons_in_order("GoodbyeReason", table_below("| goodbye |"), 4);
}

TEST(ProtocolPage, states_the_numbers_of_all_other_enums) {
  const std::vector<Row> rows = table_below("| u8 |");
  std::set<std::string> named{"ErrorReason", "GoodbyeReason"};
  for (const Row& row : rows) {
    named.insert(row.front());
    std::vector<std::string> values(row.begin() + 1, row.end());
    while (!values.empty() && values.back().empty()) values.pop_back();
    EXPECT_EQ(values, values_of(row.front())) << row.front();
  }
  const std::vector<std::string> enums = matches_of(text_of("schema/enums.fbs"), "enum (\\w+) :");
  EXPECT_EQ(named, std::set<std::string>(enums.begin(), enums.end()));
}

// Compares the page's tables of messages with the variants of C++, and each message's fields with its table of the
// schema. Goodbye is in both variants, which explains the ones that are added and taken off below.
TEST(ProtocolPage, has_a_row_with_the_fields_of_every_message) {
  const auto alternatives = [](const std::string& path, const std::string& variant) {
    const std::string text = text_of(path);
    const std::size_t begin = text.find('<', text.find("using " + variant + " ="));
    const auto names = matches_of(text.substr(begin, text.find('>', begin) - begin), "(\\w+)");
    return std::set<std::string>(names.begin(), names.end());
  };
  const auto client = alternatives("schema/wire/client_messages.hpp", "ClientMessage");
  const auto server = alternatives("schema/wire/server_messages.hpp", "ServerMessage");
  std::map<std::string, std::vector<Row>> tables;
  for (const char* section :
       {"## Messages from client to server", "## Messages from server to client", "## Messages in both directions"})
    tables[section] = table_below(section);
  std::string messages = block_of("schema/messages.fbs", "union Body");
  for (const std::string& name : matches_of(messages.substr(messages.find('{')), "(\\w+)")) {
    ASSERT_TRUE(client.contains(name) || server.contains(name)) << name;
    const std::vector<Row>& rows = tables[!server.contains(name)  ? "## Messages from client to server"
                                          : client.contains(name) ? "## Messages in both directions"
                                                                  : "## Messages from server to client"];
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const Row& each) { return each.front() == name; });
    ASSERT_NE(row, rows.end()) << name;
    ASSERT_EQ(row->size(), 3u) << name;
    std::vector<std::string> stated = matches_of((*row)[1], "`(\\w+)`");
    std::vector<std::string> fields =
        matches_of(block_of("schema/messages.fbs", "table " + name + " {"), "\n  (\\w+): ");
    std::sort(stated.begin(), stated.end());
    std::sort(fields.begin(), fields.end());
    EXPECT_EQ(stated, fields) << name;
  }
  EXPECT_EQ(tables["## Messages from client to server"].size() + tables["## Messages from server to client"].size() + 1,
            std::variant_size_v<Message>);
  EXPECT_EQ(client.size() + server.size() - 1, std::variant_size_v<Message>);
}

TEST(ProtocolPage, documents_what_the_decoder_says) {
  const std::vector<Row> rows = table_below("| in the decoder |");
  ASSERT_EQ(rows.size(), static_cast<std::size_t>(DecodeError::invalid));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    EXPECT_EQ(rows[i].front(), to_string(static_cast<DecodeError>(i + 1)));
    EXPECT_EQ(rows[i].size(), 2u) << rows[i].front();
  }
}

// Returns the constants of a header by name, in the form in which the page writes numbers.
std::map<std::string, std::string> constants_of(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::map<std::string, std::string> found;
  for (std::sregex_iterator it(text.begin(), text.end(), regex), end; it != end; ++it) {
    std::string number = (*it)[2];
    std::erase_if(number, [](char c) { return c == '\'' || c == 'f'; });
    found[(*it)[1]] = number;
  }
  return found;
}

std::map<std::string, std::string> stated_below(const std::string& header) {
  std::map<std::string, std::string> stated;
  for (const Row& row : table_below(header)) stated[row.at(0)] = row.at(1);
  return stated;
}

TEST(ProtocolPage, states_the_limits_that_hold) {
  auto limits = constants_of(text_of("schema/limits.hpp"), "inline constexpr [\\w:]+ (k\\w+) = ([\\d'.f]+);");
  EXPECT_EQ(limits.extract("kProtocolVersion").mapped(), std::to_string(kProtocolVersion));
  // The counts here and below make sure that the pattern still finds every constant; a new limit raises them.
  EXPECT_EQ(limits.size(), 29u);
  EXPECT_EQ(limits["kTimeMax_ns"], std::to_string(kTimeMax_ns));
  EXPECT_EQ(stated_below("| limit |"), limits);
}

TEST(ProtocolPage, states_the_limits_of_grooms) {
  const auto limits = constants_of(block_of("core/groom/groom.hpp", "struct GroomLimits {"), "(\\w+) = ([\\d'.f]+);");
  EXPECT_EQ(limits.size(), 7u);
  EXPECT_EQ(stated_below("| groom |"), limits);
}

TEST(ProtocolPage, states_the_version) {
  ASSERT_FALSE(page_lines().empty());
  EXPECT_EQ(page_lines().front(), "# The Hairnet protocol, version " + std::to_string(kProtocolVersion));
}

TEST(ProtocolPage, has_vectors_that_are_what_is_written_and_read) {
  const Bytes content{0xAA, 0xBB};
  Frame frame;
  frame.member = 300;
  frame.level = LevelIndex::low;
  frame.step_stride = 2;
  frame.content = content;
  constexpr Appearance kRed{{0x9e, 0x58, 0x2f}, {0xb0, 0x70, 0x40}, {0xe0, 0xc0, 0xb0}, 77};
  // These are the messages whose bytes the page shows, in its order.
  const std::vector<Envelope> said{{1'000'000'000, Hello{4, "example", "hall", "", Role::participant, 0, {}, 28}},
                                   {2'000'000'000, SetLevel{7, LevelIndex::low}},
                                   {3'000'000'000, SetAppearance{7, "Ann", kRed}},
                                   {4'000'000'000, MemberChanged{300, "Ann", kRed}},
                                   {3'000'000'000, FrameBatch{42, 2'975'000'000, {frame}, nullptr}}};
  const std::vector<Bytes> packets = vectors();
  ASSERT_EQ(packets.size(), said.size() + 1);
  for (std::size_t i = 0; i < said.size(); ++i) {
    EXPECT_EQ(packets[i], encode_packet(said[i])) << "vector " << i;
    EXPECT_EQ(decode_packet(packets[i]).error, DecodeError::none) << "vector " << i;
  }
  EXPECT_EQ(packets.back(), encode_frame_datagram(3'000'000'000, {42, 2'975'000'000, {frame}, nullptr, {5}}));
  EXPECT_EQ(decode_frame_datagram(packets.back()).error, DecodeError::none);
}

}  // namespace
}  // namespace hairnet::wire
