#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

#include "schema/http3/control_stream.hpp"
#include "schema/http3/field_section.hpp"
#include "schema/http3/frame_reader.hpp"
#include "schema/http3/varint.hpp"
#include "server/http3/request.hpp"
#include "tests/support/http3_client.hpp"

namespace hairnet::http3 {
namespace {

using testing::ElementsAre;

Bytes encoded(std::uint64_t value) {
  Bytes bytes;
  put_varint(bytes, value);
  return bytes;
}

TEST(Http3Varint, has_the_examples_of_rfc_9000) {
  const Bytes eight{0xc2, 0x19, 0x7c, 0x5e, 0xff, 0x14, 0xe8, 0x8c};
  EXPECT_EQ(read_varint(eight).value, 151'288'809'941'952'652u);
  EXPECT_EQ(encoded(151'288'809'941'952'652u), eight);
  EXPECT_THAT(encoded(494'878'333), ElementsAre(0x9d, 0x7f, 0x3e, 0x7d));
  EXPECT_THAT(encoded(15'293), ElementsAre(0x7b, 0xbd));
  EXPECT_THAT(encoded(37), ElementsAre(0x25));
  // A number need not have the shortest form.
  EXPECT_EQ(read_varint(Bytes{0x40, 0x25}).value, 37u);
}

TEST(Http3Varint, comes_back_at_every_border_and_is_incomplete_when_cut) {
  for (const std::uint64_t value :
       {std::uint64_t{0}, std::uint64_t{63}, std::uint64_t{64}, std::uint64_t{16'383}, std::uint64_t{16'384},
        (std::uint64_t{1} << 30) - 1, std::uint64_t{1} << 30, kVarintMax}) {
    const Bytes bytes = encoded(value);
    const Varint read = read_varint(bytes);
    EXPECT_EQ(read.value, value);
    EXPECT_EQ(read.bytes, bytes.size());
    for (std::size_t cut = 0; cut < bytes.size(); ++cut) EXPECT_EQ(read_varint(std::span(bytes).first(cut)).bytes, 0u);
  }
}

TEST(Http3FrameReader, gives_the_same_frames_however_the_bytes_arrive) {
  Bytes stream;
  put_frame(stream, 0x00, Bytes(300, 7));
  // This frame is empty, and the type of the next one takes two bytes.
  put_frame(stream, 0x21, {});
  put_frame(stream, 0x4000, Bytes{1, 2, 3});
  for (std::size_t piece_bytes = 1; piece_bytes <= stream.size(); ++piece_bytes) {
    FrameReader reader;
    std::vector<std::pair<std::uint64_t, Bytes>> frames;
    std::size_t complete = 0;
    for (std::size_t at = 0; at < stream.size(); at += piece_bytes) {
      const std::span bytes = std::span(stream).subspan(at, std::min(piece_bytes, stream.size() - at));
      reader.feed(bytes, [&](const FrameReader::Piece& piece) {
        if (piece.is_first) frames.emplace_back(piece.type, Bytes());
        frames.back().second.insert(frames.back().second.end(), piece.bytes.begin(), piece.bytes.end());
        complete += piece.is_last ? 1 : 0;
        EXPECT_EQ(piece.is_last, frames.back().second.size() == piece.length);
        return true;
      });
    }
    ASSERT_EQ(frames.size(), 3u);
    EXPECT_EQ(complete, 3u);
    EXPECT_EQ(frames[0], std::pair(std::uint64_t{0}, Bytes(300, 7)));
    EXPECT_EQ(frames[1], std::pair(std::uint64_t{0x21}, Bytes()));
    EXPECT_EQ(frames[2], std::pair(std::uint64_t{0x4000}, (Bytes{1, 2, 3})));
    EXPECT_TRUE(reader.is_between_frames());
  }
}

TEST(Http3FrameReader, knows_that_a_cut_stream_ends_within_a_frame) {
  Bytes stream;
  put_frame(stream, 0x21, Bytes{1, 2, 3});
  for (std::size_t cut = 1; cut < stream.size(); ++cut) {
    FrameReader reader;
    reader.feed(std::span(stream).first(cut), [](const auto&) { return true; });
    EXPECT_FALSE(reader.is_between_frames()) << cut;
  }
}

TEST(Http3Settings, are_those_that_browsers_ask_for) {
  const Bytes stream = control_stream_begin();
  EXPECT_EQ(stream[0], kControlStream);
  EXPECT_EQ(stream[1], kSettingsFrame);
  ASSERT_EQ(stream[2], stream.size() - 3);
  std::span<const std::uint8_t> payload = std::span(stream).subspan(3);
  EXPECT_TRUE(read_settings(payload));
  std::vector<std::pair<std::uint64_t, std::uint64_t>> settings;
  while (!payload.empty()) {
    const Varint name = read_varint(payload), value = read_varint(payload.subspan(name.bytes));
    settings.emplace_back(name.value, value.value);
    payload = payload.subspan(name.bytes + value.bytes);
  }
  // These settings enable extended CONNECT and datagrams, and WebTransport by the names of drafts 2, 7 to 12, and 13
  // and later (control_stream.cpp): browsers look for different ones.
  EXPECT_THAT(settings, ElementsAre(std::pair(0x08, 1), std::pair(0x33, 1), std::pair(0x2b603742, 1),
                                    std::pair(0xc671706a, 16), std::pair(0x14e9cd29, 16)));
}

TEST(Http3Settings, of_http2_and_repeated_or_cut_ones_are_not_valid) {
  EXPECT_TRUE(read_settings({}));
  EXPECT_TRUE(read_settings(Bytes{0x33, 1, 0x21, 9}));
  // Names 2 to 5 are settings of HTTP/2, which HTTP/3 forbids (RFC 9114, section 7.2.4.1).
  EXPECT_FALSE(read_settings(Bytes{0x02, 1}));
  EXPECT_FALSE(read_settings(Bytes{0x05, 1}));
  EXPECT_FALSE(read_settings(Bytes{0x33, 1, 0x33, 1}));
  EXPECT_FALSE(read_settings(Bytes{0x33}));
  EXPECT_FALSE(read_settings(Bytes{0x33, 0x40}));
}

std::vector<std::pair<std::string, std::string>> decoded(const Bytes& section) {
  std::vector<std::pair<std::string, std::string>> fields;
  const DecodedFields found = decode_fields(section);
  EXPECT_EQ(found.outcome, DecodedFields::Outcome::decoded);
  for (const Field& field : found.fields) fields.emplace_back(field.name, field.value);
  return fields;
}

TEST(Http3Fields, decode_the_example_of_rfc_9204) {
  // Appendix B.1 has a literal value with a name of the static table.
  Bytes section{0x00, 0x00, 0x51, 0x0b};
  put(section, "/index.html");
  EXPECT_THAT(decoded(section), ElementsAre(std::pair(":path", "/index.html")));
}

TEST(Http3Fields, decode_static_entries_and_huffman_strings) {
  // These are entries 15 and 23 of the static table.
  EXPECT_THAT(decoded({0x00, 0x00, 0xcf, 0xd7}),
              ElementsAre(std::pair(":method", "CONNECT"), std::pair(":scheme", "https")));
  // The value is "www.example.com" in the Huffman code of RFC 7541 (appendix C.4.1); entry 0 of the static table has
  // the name.
  Bytes section{0x00, 0x00, 0x50, 0x8c};
  section.insert(section.end(), {0xf1, 0xe3, 0xc2, 0xe5, 0xf2, 0x3a, 0x6b, 0xa0, 0xab, 0x90, 0xf4, 0xff});
  EXPECT_THAT(decoded(section), ElementsAre(std::pair(":authority", "www.example.com")));
  // This is "custom-key: custom-value" of appendix C.4.3, with a literal name.
  section = {0x00, 0x00, 0x2f, 0x01};
  section.insert(section.end(), {0x25, 0xa8, 0x49, 0xe9, 0x5b, 0xa9, 0x7d, 0x7f, 0x89});
  section.insert(section.end(), {0x25, 0xa8, 0x49, 0xe9, 0x5b, 0xb8, 0xe8, 0xb4, 0xbf});
  EXPECT_THAT(decoded(section), ElementsAre(std::pair("custom-key", "custom-value")));
}

TEST(Http3Fields, refuse_the_dynamic_table_and_wrong_huffman_codes) {
  for (const Bytes& section : std::vector<Bytes>{
           // The prefix is missing.
           {},
           // The prefix asks for an entry that must have been inserted before.
           {0x02, 0x00, 0x80},
           // This is entry 0 of the dynamic table, which is empty.
           {0x00, 0x00, 0x80},
           // This is the dynamic entry one past the base.
           {0x00, 0x00, 0x10},
           // Static entry 191 does not exist: there are 99.
           {0x00, 0x00, 0xff, 0x80, 0x01},
           // The padding is of zeros instead of ones.
           {0x00, 0x00, 0x50, 0x81, 0x00},
           // The code for the end of the string lies within the string.
           {0x00, 0x00, 0x50, 0x84, 0xff, 0xff, 0xff, 0xff},
           // The length is beyond all bounds.
           {0x00, 0x00, 0x50, 0x7f, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f},
       })
    EXPECT_EQ(decode_fields(section).outcome, DecodedFields::Outcome::damaged) << testing::PrintToString(section);
}

TEST(Http3Fields, are_damaged_when_they_are_cut_within_a_field) {
  const Bytes section = encode_fields({{":method", "CONNECT"}});
  for (std::size_t cut = 0; cut < section.size(); ++cut) {
    const DecodedFields found = decode_fields(std::span(section).first(cut));
    if (cut == 2)
      // The two bytes of the prefix alone are an empty section.
      EXPECT_TRUE(found.fields.empty());
    else
      EXPECT_EQ(found.outcome, DecodedFields::Outcome::damaged) << cut;
  }
}

TEST(Http3Fields, that_are_too_many_or_grow_too_large_are_refused) {
  Bytes many{0, 0};
  // Each byte 0xcf is a whole field, entry 15 of the static table.
  many.insert(many.end(), kFieldsMax + 1, 0xcf);
  EXPECT_EQ(decode_fields(many).outcome, DecodedFields::Outcome::too_many);
  many.pop_back();
  EXPECT_EQ(decode_fields(many).outcome, DecodedFields::Outcome::decoded);
  // In Huffman's code a letter a has 5 bits, eight of them these five bytes, and two bytes name the 76 letters of the
  // static table's entry 85. So 8 KiB can hold more than kFieldBytesMax.
  Bytes large{0, 0, 0x21, 'a', 0xff, 0xc1, 0x3d};
  for (int n = 0; n < 8000 / 5; ++n) large.insert(large.end(), {0x18, 0xc6, 0x31, 0x8c, 0x63});
  for (int n = 0; n < 20; ++n) large.insert(large.end(), {0xff, 85 - 63});
  EXPECT_EQ(decode_fields(large).outcome, DecodedFields::Outcome::decoded);
  for (int n = 0; n < 40; ++n) large.insert(large.end(), {0xff, 85 - 63});
  ASSERT_LE(large.size(), kFieldSectionBytesMax);
  EXPECT_EQ(decode_fields(large).outcome, DecodedFields::Outcome::too_many);
}

TEST(Http3Fields, that_are_damaged_at_random_never_break_the_bounds) {
  std::mt19937 random(1);
  const Bytes valid = encode_fields({{":method", "CONNECT"}, {":path", "/ws"}, {"origin", "https://a.example"}});
  for (int n = 0; n < 20'000; ++n) {
    Bytes section = valid;
    for (int k = 0; k < 3; ++k) section[random() % section.size()] = static_cast<std::uint8_t>(random());
    const DecodedFields found = decode_fields(section);
    EXPECT_LE(found.fields.size(), kFieldsMax + 1);
  }
}

TEST(Http3Response, has_the_bytes_that_a_browser_was_seen_to_take) {
  // The last byte is entry 25 of the static table: ":status: 200".
  EXPECT_THAT(encode_response(200, false), ElementsAre(0x00, 0x00, 0xd9));
  EXPECT_THAT(decoded(encode_response(200, true)),
              ElementsAre(std::pair(":status", "200"), std::pair("sec-webtransport-http3-draft", "draft02")));
  for (const int status : {400, 403, 404, 429, 503})
    EXPECT_THAT(decoded(encode_response(status, false)), ElementsAre(std::pair(":status", std::to_string(status))));
}

Result<Request> request(const std::vector<std::pair<std::string_view, std::string_view>>& fields) {
  return read_request(decode_fields(encode_fields(fields)).fields);
}

TEST(Http3Request, asks_for_a_session_by_an_extended_connect) {
  const auto asked = request({{":method", "CONNECT"},
                              {":protocol", "webtransport"},
                              {":scheme", "https"},
                              {":authority", "a:1"},
                              {":path", "/ws"},
                              {"origin", "https://b"},
                              {"x", "y"}});
  ASSERT_TRUE(asked);
  EXPECT_TRUE(asked->asks_for_session());
  EXPECT_EQ(asked->path, "/ws");
  EXPECT_EQ(asked->authority, "a:1");
  EXPECT_EQ(asked->origin, "https://b");
  const auto get = request({{":method", "GET"}, {":scheme", "https"}, {":authority", "a"}, {":path", "/"}});
  ASSERT_TRUE(get);
  EXPECT_FALSE(get->asks_for_session());
}

TEST(Http3Request, that_no_client_may_send_is_refused) {
  // The faults are, in order: no fields, no scheme and path, a method twice, a plain field before the method, a field
  // of responses, a protocol without CONNECT, a capital letter in a name, a line break in a value, and two origins.
  EXPECT_FALSE(request({}));
  EXPECT_FALSE(request({{":method", "GET"}}));
  EXPECT_FALSE(request({{":method", "GET"}, {":method", "GET"}, {":scheme", "https"}, {":path", "/"}}));
  EXPECT_FALSE(request({{"x", "y"}, {":method", "GET"}, {":scheme", "https"}, {":path", "/"}}));
  EXPECT_FALSE(request({{":method", "GET"}, {":scheme", "https"}, {":path", "/"}, {":status", "200"}}));
  EXPECT_FALSE(request({{":method", "GET"}, {":scheme", "https"}, {":path", "/"}, {":protocol", "webtransport"}}));
  EXPECT_FALSE(request({{":method", "GET"}, {":scheme", "https"}, {":path", "/"}, {"Upper", "x"}}));
  EXPECT_FALSE(request({{":method", "GET"}, {":scheme", "https"}, {":path", "/"}, {"x", "a\nb"}}));
  EXPECT_FALSE(request({{":method", "GET"}, {":scheme", "https"}, {":path", "/"}, {"origin", "a"}, {"origin", "b"}}));
}

}  // namespace
}  // namespace hairnet::http3
