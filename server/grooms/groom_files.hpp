#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

#include "schema/wire/groom_file.hpp"
#include "server/exchange/character_key.hpp"
#include "server/grooms/groom_builder.hpp"

namespace hairnet::server {

// Finds files for clients that draw grooms, by the hash of each file. The class owns no file: it has weak pointers, so
// that an evicted groom's memory is freed once the last download has ended. For sessions it asks the builder to read
// files of the groom cache. I/O thread.
class GroomFiles {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  explicit GroomFiles(GroomBuilder& builder) : builder_(&builder) {}

  // Clients can have the file from now on, while somebody has it in memory. Returns its hash.
  wire::GroomHash add(const Bytes& file) {
    const wire::GroomHash hash = wire::hash_groom(*file);
    files_[hash] = file;
    return hash;
  }
  // Returns null when nobody has the file in memory.
  [[nodiscard]] Bytes find(const wire::GroomHash& hash) const {
    const auto file = files_.find(hash);
    return file == files_.end() ? nullptr : file->second.lock();
  }
  void erase_expired() {
    std::erase_if(files_, [](const auto& file) { return file.second.expired(); });
  }

  // The builder reads the groom's file for the session. Returns false when the cache does not have it.
  bool fetch(SessionId session, const wire::GroomHash& groom) {
    if (!builder_->is_cached(groom)) return false;
    const auto [fetched, is_new] = fetches_.try_emplace(groom);
    if (is_new) builder_->read(groom);
    std::vector<SessionId>& waiting = fetched->second;
    if (std::ranges::find(waiting, session) == waiting.end()) waiting.push_back(session);
    return true;
  }
  // Takes a file that was read, or null, and returns the sessions that wait for it.
  std::vector<SessionId> take(const wire::GroomHash& groom, const Bytes& file) {
    if (file) files_[groom] = file;
    auto fetched = fetches_.extract(groom);
    return fetched ? std::move(fetched.mapped()) : std::vector<SessionId>();
  }
  // The read itself goes on: the builder cannot take it back.
  void forget(SessionId session) {
    for (auto& [groom, waiting] : fetches_) std::erase(waiting, session);
  }

 private:
  GroomBuilder* builder_;
  std::map<wire::GroomHash, std::weak_ptr<const std::vector<std::uint8_t>>> files_;
  // By groom that the builder was asked to read: the sessions that wait for the file.
  std::map<wire::GroomHash, std::vector<SessionId>> fetches_;
};

}  // namespace hairnet::server
