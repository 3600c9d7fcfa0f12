#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "schema/channel/packet_splitter.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/messages.hpp"

// PROTOCOL.md is the contract: its figures, names and bytes must equal those of the code.
namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

static_assert(channel::kPacketBytesLeast == kPacketBytesMin);

std::vector<std::string> page_lines() {
  std::ifstream file(HAIRNET_PROTOCOL_FILE);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

// The cells of the table row whose first cell is `name` in backquotes; empty when there is none.
std::vector<std::string> row_of(const std::string& name, std::size_t column_count) {
  for (const std::string& line : page_lines()) {
    if (line.rfind("| `" + name + "` |", 0) != 0) continue;
    std::vector<std::string> cells;
    std::istringstream row(line.substr(1));
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell.substr(1, cell.size() - 2));
    if (cells.size() == column_count) return cells;
  }
  return {};
}

// The packets of the section "Vectors", in order.
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

TEST(ProtocolPage, documents_every_error_and_what_to_do) {
  for (std::uint8_t r = 1; r <= static_cast<std::uint8_t>(kErrorReasonLast); ++r) {
    const std::string name = to_string(static_cast<ErrorReason>(r));
    const std::vector<std::string> row = row_of(name, 3);
    ASSERT_FALSE(row.empty()) << name;
    EXPECT_GT(row[2].size(), 3u) << name;
  }
}

TEST(ProtocolPage, documents_every_goodbye_and_what_to_do) {
  for (std::uint8_t r = 1; r <= static_cast<std::uint8_t>(kGoodbyeReasonLast); ++r) {
    const std::string name = to_string(static_cast<GoodbyeReason>(r));
    EXPECT_FALSE(row_of(name, 4).empty()) << name;
  }
}

TEST(ProtocolPage, documents_every_decoder_error) {
  for (std::uint8_t r = 1; r <= static_cast<std::uint8_t>(DecodeError::invalid); ++r) {
    const std::string name = to_string(static_cast<DecodeError>(r));
    EXPECT_FALSE(row_of(name, 2).empty()) << name;
  }
}

TEST(ProtocolPage, states_the_limits_of_the_code) {
  const auto stated = [](const std::string& name) {
    const std::vector<std::string> row = row_of(name, 3);
    return row.empty() ? std::string("nothing") : row[1];
  };
  EXPECT_EQ(stated("kPacketBytesMax"), std::to_string(kPacketBytesMax));
  EXPECT_EQ(stated("kPacketBytesMin"), std::to_string(kPacketBytesMin));
  EXPECT_EQ(stated("kGroomChunkBytesMax"), std::to_string(kGroomChunkBytesMax));
  EXPECT_EQ(stated("kGroomBytesMax"), std::to_string(kGroomBytesMax));
  EXPECT_EQ(stated("kPosesPerBatchMax"), std::to_string(kPosesPerBatchMax));
  EXPECT_EQ(stated("kMembersPerMessageMax"), std::to_string(kMembersPerMessageMax));
  EXPECT_EQ(stated("kHairStateIntegersMax"), std::to_string(kHairStateIntegersMax));
  EXPECT_EQ(stated("kRoomNameBytesMax"), std::to_string(kRoomNameBytesMax));
  EXPECT_EQ(stated("kTokenBytesMax"), std::to_string(kTokenBytesMax));
  EXPECT_EQ(stated("kStrideMax"), std::to_string(kStrideMax));
  EXPECT_EQ(stated("kObserveRadiusMax_m"), std::to_string(static_cast<int>(kObserveRadiusMax_m)));
  EXPECT_EQ(stated("kScreenHeightMax"), std::to_string(static_cast<int>(kScreenHeightMax)));
  EXPECT_EQ(stated("kTextBytesMax"), std::to_string(kTextBytesMax));
  EXPECT_EQ(stated("kPositionMax_m"), std::to_string(static_cast<int>(kPositionMax_m)));
  EXPECT_EQ(stated("kTimeMax_ns"), std::to_string(kTimeMax_ns));
  EXPECT_EQ(stated("kTickRateMax_hz"), std::to_string(kTickRateMax_hz));
  EXPECT_EQ(stated("kLatticeNodesPerAxisMax"), std::to_string(kLatticeNodesPerAxisMax));
  EXPECT_EQ(stated("kLatticeCoordinateMax_m"), std::to_string(static_cast<int>(kLatticeCoordinateMax_m)));
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
  frame.order = 3;
  frame.stride = 2;
  frame.step_stride = 2;
  frame.content = content;
  const std::vector<Envelope> said{{1'000'000'000, Hello{3, "example", "hall", "", Role::participant, 0, {}}},
                                   {2'000'000'000, SetLevel{7, LevelIndex::low}},
                                   {3'000'000'000, FrameBatch{42, 2'975'000'000, {frame}, nullptr}}};
  const std::vector<Bytes> packets = vectors();
  ASSERT_EQ(packets.size(), said.size());
  for (std::size_t i = 0; i < said.size(); ++i) {
    EXPECT_EQ(packets[i], encode_packet(said[i])) << "vector " << i;
    EXPECT_EQ(decode_packet(packets[i]).error, DecodeError::none) << "vector " << i;
  }
}

}  // namespace
}  // namespace hairnet::wire
