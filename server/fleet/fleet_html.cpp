#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <iterator>

#include "server/fleet/fleet_values.hpp"

namespace hairnet::server {
namespace {

constexpr const char* kHead =
    R"(<!doctype html><meta charset="utf-8"><meta http-equiv="refresh" content="1"><title>Fleet</title>
<style>
body { font: 15px system-ui, sans-serif; margin: 2rem; color: #222; background: #fff }
table { border-collapse: collapse; margin: 0 0 2rem } th, td { text-align: left; padding: .3rem 1.2rem .3rem 0; border-bottom: 1px solid #ddd; unicode-bidi: isolate }
meter { width: 8rem } .warning { color: #a40 }
@media (prefers-color-scheme: dark) { body { color: #ddd; background: #181818 } th, td { border-color: #444 } }
</style>
)";

// Names and addresses come from other servers of the fleet. Their cells are isolated: one may have characters that turn
// the text around them.
std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') {
      out += "&amp;";
    } else if (c == '<') {
      out += "&lt;";
    } else if (c == '>') {
      out += "&gt;";
    } else if (c == '"') {
      out += "&quot;";
    } else {
      out += c;
    }
  }
  return out;
}

// The server's address as HTML, with a link to its page if it has one.
std::string address_of(const ServerAddress& address) {
  const std::string text = escaped(address.host) + ":" + std::to_string(address.port);
  // Only these two schemes make a link: a URL that begins with "javascript:" would run in the browser of a person who
  // clicks it.
  const bool is_link = address.page.starts_with("http://") || address.page.starts_with("https://");
  return is_link ? fmt::format("<a href=\"{}\">{}</a>", escaped(address.page), text) : text;
}

}  // namespace

std::string fleet_html(std::uint64_t self, bool is_reachable, std::span<const ServerStatus> servers,
                       std::span<const RoomOwner> rooms) {
  // A browser loads the page every second; a fleet of 131 072 rooms would be too much for it.
  constexpr std::size_t kRowsMax = 500;
  std::string page = kHead;
  const auto add = std::back_inserter(page);
  if (!is_reachable) page += "<p class=\"warning\">etcd does not answer: this is what was known last.</p>\n";
  fmt::format_to(add, "<h1>{} servers</h1>\n<table><tr><th>server<th>rooms<th>characters<th>free time<th></tr>\n",
                 servers.size());
  for (const ServerStatus& server : servers.first(std::min(servers.size(), kRowsMax)))
    fmt::format_to(add, "<tr><td>{}<td>{}<td>{}<td><meter value=\"{:.2f}\"></meter><td>{}{}</tr>\n",
                   address_of(server.address), server.load.rooms, server.load.characters, server.load.free_share,
                   server.draining            ? "drains "
                   : server.load.has_big_room ? "has a big room "
                                              : "",
                   server.id == self ? "shows this page" : "");
  fmt::format_to(add, "</table>\n<h1>{} rooms</h1>\n<table><tr><th>room<th>held by<th>claim</tr>\n", rooms.size());
  for (const RoomOwner& room : rooms.first(std::min(rooms.size(), kRowsMax))) {
    const auto owner = std::ranges::find(servers, room.server_id, &ServerStatus::id);
    fmt::format_to(add, "<tr><td>{}<td>{}<td>{}</tr>\n", escaped(room.room),
                   owner == servers.end() ? "a server that is gone" : address_of(owner->address), room.claim);
  }
  page += "</table>\n";
  if (std::max(servers.size(), rooms.size()) > kRowsMax)
    fmt::format_to(add, "<p>The first {} of each; <a href=\"fleet.json\">all of them</a>.</p>\n", kRowsMax);
  return page;
}

}  // namespace hairnet::server
