#include "server/fleet/fleet_values.hpp"

#include <fmt/format.h>
#include <sodium.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

namespace hairnet::server {
namespace {

using Json = nlohmann::ordered_json;
// The id of a server has 64 bits, so its text has 16 hexadecimal digits.
constexpr std::size_t kIdDigits = 16;

// Returns ASCII text. Bytes that are no UTF-8 are replaced and cause no exception, because names come from clients.
std::string dump(const Json& json) {
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

// The status as JSON, for etcd and for /fleet.json. to_value() adds the grooms for etcd; the page does not show them.
Json json_of(const ServerStatus& status) {
  return {{"id", id_text(status.id)},
          {"host", status.address.host},
          {"port", status.address.port},
          {"page", status.address.page},
          {"free", status.load.free_share},
          {"free_characters", status.load.free_characters},
          {"characters", status.load.characters},
          {"rooms", status.load.rooms},
          {"big_room", status.load.has_big_room},
          {"draining", status.draining}};
}

std::string base64_of(const std::vector<std::uint8_t>& bytes) {
  std::string text(sodium_base64_encoded_len(bytes.size(), sodium_base64_VARIANT_ORIGINAL), '\0');
  sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(), sodium_base64_VARIANT_ORIGINAL);
  // Sodium counts the terminating zero.
  text.pop_back();
  return text;
}

// Decodes base64. Returns false when the text is not valid.
bool read_base64(const std::string& text, std::vector<std::uint8_t>& bytes) {
  // Base64 is longer than what it codes, so there is room enough.
  bytes.resize(text.size());
  // Sodium takes no null pointer, which an empty list of bytes has.
  if (text.empty()) return true;
  std::size_t length = 0;
  const char* end = nullptr;
  const bool is_valid = sodium_base642bin(bytes.data(), bytes.size(), text.data(), text.size(), nullptr, &length, &end,
                                          sodium_base64_VARIANT_ORIGINAL) == 0;
  bytes.resize(length);
  return is_valid && end == text.data() + text.size();
}

// The hashes of grooms, one after the other, as one text in base64.
Json json_of(const std::vector<ContentHash>& grooms) {
  std::vector<std::uint8_t> bytes;
  for (const ContentHash& groom : grooms) bytes.insert(bytes.end(), groom.begin(), groom.end());
  return base64_of(bytes);
}

// Reads such a text. Refuses more than kPassedGroomsMax hashes, since any program may write to etcd.
bool read_grooms(const Json& json, std::vector<ContentHash>& grooms) {
  std::vector<std::uint8_t> bytes;
  if (!json.is_string() || !read_base64(json.get_ref<const std::string&>(), bytes)) return false;
  if (bytes.size() % sizeof(ContentHash) != 0 || bytes.size() > kPassedGroomsMax * sizeof(ContentHash)) return false;
  grooms.resize(bytes.size() / sizeof(ContentHash));
  for (std::size_t i = 0; i < grooms.size(); ++i)
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(i * sizeof(ContentHash)), sizeof(ContentHash),
                grooms[i].begin());
  return true;
}

// Whether the text has neither spaces nor control characters. Addresses must be such texts, because they go into
// messages, logs and pages.
bool is_printable(std::string_view text) {
  return std::ranges::all_of(text, [](char c) { return c > ' ' && c <= '~'; });
}

// These two read a field of an object. They return none when it is absent, of another type, or above `most`.
std::optional<std::string> text_at(const Json& json, const char* name) {
  const auto found = json.find(name);
  if (found == json.end() || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

std::optional<std::uint32_t> count_at(const Json& json, const char* name, std::uint32_t most) {
  const auto found = json.find(name);
  if (found == json.end() || !found->is_number_unsigned() || found->get<std::uint64_t>() > most) return std::nullopt;
  return found->get<std::uint32_t>();
}

// The end of a ban is refused after this time, the end of the year 9999.
constexpr std::uint64_t kUnixTimeMax_s = 253'402'300'799;
// A subject in a kept text has at most this many bytes.
constexpr std::size_t kNameBytesMax = 1024;

// Whether the value is a text of 1 to kNameBytesMax bytes, as a subject must be.
bool is_name(const Json& json) {
  return json.is_string() && !json.get_ref<const std::string&>().empty() &&
         json.get_ref<const std::string&>().size() <= kNameBytesMax;
}

// Reads a field that is a list of names. Returns false when it is absent or not valid.
bool read_names(const Json& json, const char* name, std::vector<std::string>& to) {
  const auto list = json.find(name);
  if (list == json.end() || !list->is_array() || !std::ranges::all_of(*list, is_name)) return false;
  for (const Json& one : *list) to.push_back(one.get<std::string>());
  return true;
}

}  // namespace

std::string id_text(std::uint64_t id) {
  return fmt::format("{:016x}", id);
}

std::optional<std::uint64_t> parse_id(std::string_view text) {
  std::uint64_t id = 0;
  // from_chars takes fewer digits, too; a key has exactly 16, so that each id has one text.
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id, 16);
  if (text.size() != kIdDigits || error != std::errc() || end != text.data() + text.size() || id == 0)
    return std::nullopt;
  return id;
}

std::string validate(const ServerAddress& address) {
  if (address.host.empty() || address.host.size() > kHostBytesMax || !is_printable(address.host))
    return "the host of a server's address must be a name or a numeric address";
  if (address.page.size() > kPageBytesMax || !is_printable(address.page))
    return "the page of a server's address must be a URL of at most " + std::to_string(kPageBytesMax) + " letters";
  return {};
}

std::string to_value(const ServerStatus& status) {
  Json json = json_of(status);
  if (!status.grooms.empty()) json["grooms"] = json_of(status.grooms);
  return dump(json);
}

Result<ServerStatus> parse_status(std::string_view value) {
  const Json json = Json::parse(value.begin(), value.end(), nullptr, false);
  if (json.is_discarded() || !json.is_object()) return Refusal("a server's status is not a JSON object");
  constexpr std::uint32_t kMany = std::numeric_limits<std::uint32_t>::max();
  const auto id = parse_id(text_at(json, "id").value_or(""));
  const auto host = text_at(json, "host"), page = text_at(json, "page");
  const auto port = count_at(json, "port", 65535), free_characters = count_at(json, "free_characters", kMany),
             characters = count_at(json, "characters", kMany), rooms = count_at(json, "rooms", kMany);
  const auto free = json.find("free"), draining = json.find("draining"), big_room = json.find("big_room");
  if (!id || !host || !page || !port || !free_characters || !characters || !rooms || free == json.end() ||
      !free->is_number() || draining == json.end() || !draining->is_boolean() ||
      (big_room != json.end() && !big_room->is_boolean()))
    return Refusal("a server's status lacks a field, or has one of the wrong type");
  ServerStatus status{.id = *id,
                      .address = {.host = *host, .port = static_cast<std::uint16_t>(*port), .page = *page},
                      .load = {.free_share = free->get<double>(),
                               .free_characters = *free_characters,
                               .characters = *characters,
                               .rooms = *rooms,
                               .has_big_room = big_room != json.end() && big_room->get<bool>()},
                      .draining = draining->get<bool>()};
  if (std::string wrong = validate(status.address); !wrong.empty()) return Refusal(std::move(wrong));
  // The condition is written so that NaN fails, too.
  if (!(status.load.free_share >= 0 && status.load.free_share <= 1))
    return Refusal("a server's free share is not between 0 and 1");
  if (const auto grooms = json.find("grooms"); grooms != json.end() && !read_grooms(*grooms, status.grooms))
    return Refusal("the grooms of a server's status are not the hashes of at most " + std::to_string(kPassedGroomsMax));
  return status;
}

std::string owner_value(std::uint64_t server_id) {
  return id_text(server_id);
}

std::optional<std::uint64_t> parse_owner(std::string_view value) {
  return parse_id(value);
}

std::string to_value(const RoomKept& kept, std::size_t& left_out) {
  left_out = 0;
  if (kept == RoomKept{}) return {};
  Json json{{"locked", kept.is_locked},
            {"wind", base64_of(kept.wind)},
            {"members", Json::array()},
            {"mutes", Json::array()},
            {"bans", Json::array()}};
  std::size_t bytes = dump(json).size();
  const auto add = [&](const char* name, Json entry) {
    // The entry's size counts after escaping, with one byte more for the comma.
    const std::size_t more = dump(entry).size() + 1;
    if (bytes + more > kKeptBytesMax) {
      ++left_out;
      return;
    }
    bytes += more;
    json[name].push_back(std::move(entry));
  };
  for (const std::string& mute : kept.mutes) add("mutes", mute);
  for (const RoomKept::Ban& ban : kept.bans) add("bans", Json::array({ban.subject, ban.until_s}));
  for (const std::string& member : kept.members) add("members", member);
  // The props are one packet, so they fit as a whole or are left out.
  if (kept.props.empty()) return dump(json);
  const Json props{{"props", base64_of(kept.props)}};
  if (bytes + dump(props).size() > kKeptBytesMax)
    ++left_out;
  else
    json.update(props);
  return dump(json);
}

Result<RoomKept> parse_kept(std::string_view value) {
  if (value.size() > kKeptBytesMax) return Refusal("what was kept of the room is too long");
  const Json json = Json::parse(value.begin(), value.end(), nullptr, false);
  const Refusal wrong("what was kept of the room lacks a field, or has one of the wrong type");
  if (json.is_discarded() || !json.is_object()) return wrong;
  const auto locked = json.find("locked"), bans = json.find("bans");
  const auto wind = text_at(json, "wind");
  RoomKept kept;
  if (locked == json.end() || !locked->is_boolean() || !wind || bans == json.end() || !bans->is_array() ||
      !read_names(json, "members", kept.members) || !read_names(json, "mutes", kept.mutes))
    return wrong;
  kept.is_locked = locked->get<bool>();
  if (!read_base64(*wind, kept.wind)) return wrong;
  if (json.contains("props")) {
    const auto props = text_at(json, "props");
    if (!props || !read_base64(*props, kept.props)) return wrong;
  }
  for (const Json& ban : *bans) {
    if (!ban.is_array() || ban.size() != 2 || !is_name(ban[0]) || !ban[1].is_number_unsigned() ||
        ban[1].get<std::uint64_t>() > kUnixTimeMax_s)
      return wrong;
    kept.bans.push_back({ban[0].get<std::string>(), ban[1].get<std::int64_t>()});
  }
  return kept;
}

std::string room_json(std::string_view room, const RoomPlace& place) {
  Json answer{{"room", room}, {"state", to_string(place.kind)}};
  if (place.server_id == 0) {
    answer["reason"] = place.reason;
  } else {
    answer["server"] = id_text(place.server_id);
    answer["host"] = place.address.host;
    answer["port"] = place.address.port;
    answer["page"] = place.address.page;
  }
  return dump(answer) + "\n";
}

std::string fleet_json(std::uint64_t self, bool is_reachable, std::span<const ServerStatus> servers,
                       std::span<const RoomOwner> rooms) {
  Json page{{"self", id_text(self)}, {"reachable", is_reachable}, {"servers", Json::array()}, {"rooms", Json::array()}};
  for (const ServerStatus& status : servers) page["servers"].push_back(json_of(status));
  for (const RoomOwner& owner : rooms)
    page["rooms"].push_back({{"room", owner.room}, {"server", id_text(owner.server_id)}, {"claim", owner.claim}});
  return dump(page) + "\n";
}

}  // namespace hairnet::server
