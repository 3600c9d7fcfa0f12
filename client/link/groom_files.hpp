#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "client/link/events.hpp"
#include "client/link/file_catalog.hpp"
#include "core/assert.hpp"
#include "core/result.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Files that the server makes of grooms, of one kind (bases, learnt hair), as it announced them and as they have
// arrived. One thread.
template <class Known>
class GroomFiles {
 public:
  using Decode = Result<Known> (*)(std::span<const std::uint8_t> bytes);
  // Asserts that `known` is not null.
  GroomFiles(std::shared_ptr<KnownFiles<Known>> known, Decode decode) : known_(std::move(known)), decode_(decode) {
    HAIRNET_ASSERT(known_);
  }

  // Takes the announcement of a groom's file. The same file comes again over each connection; another file replaces the
  // one that is here.
  void announce(const wire::GroomHash& groom, const wire::GroomHash& file) {
    Entry& entry = entries_[groom];
    if (entry.file != file) entry = {file, known_->find(file), false, std::nullopt};
  }
  // Returns the file to ask for when a frame needs the groom's file. None: the file is here, cannot be used, was not
  // announced, or was asked for less than kAskAgain_ns ago.
  std::optional<wire::GroomHash> wanted(const wire::GroomHash& groom, std::int64_t now_ns) {
    const auto found = entries_.find(groom);
    if (found == entries_.end()) return std::nullopt;
    Entry& entry = found->second;
    if (!entry.known) entry.known = known_->find(entry.file);
    if (entry.known || entry.is_unusable) return std::nullopt;
    if (entry.asked_ns && now_ns - *entry.asked_ns < kAskAgain_ns) return std::nullopt;
    entry.asked_ns = now_ns;
    return entry.file;
  }
  // The grooms whose file has this hash.
  [[nodiscard]] std::vector<wire::GroomHash> grooms_of(const wire::GroomHash& file) const {
    std::vector<wire::GroomHash> grooms;
    for (const auto& [groom, entry] : entries_) {
      if (entry.file == file) grooms.push_back(groom);
    }
    return grooms;
  }
  // Takes a file, which several grooms may have. Returns why it cannot be used; empty: it can.
  std::string take(const GroomFetched& fetched) {
    if (!fetched.bytes) return fetched.error;
    Result<Known> decoded = decode_(*fetched.bytes);
    const auto known = decoded ? known_->keep(fetched.hash, std::move(*decoded)) : nullptr;
    for (auto& [groom, entry] : entries_) {
      if (entry.file != fetched.hash) continue;
      entry.known = known;
      entry.is_unusable = !known;
    }
    return decoded ? std::string() : decoded.error();
  }
  // Returns null when the groom's file is not here.
  [[nodiscard]] std::shared_ptr<const Known> of(const wire::GroomHash& groom) const {
    const auto found = entries_.find(groom);
    return found == entries_.end() ? nullptr : found->second.known;
  }
  // Returns the hash of the groom's file; none: the server has announced none.
  [[nodiscard]] std::optional<wire::GroomHash> file_of(const wire::GroomHash& groom) const {
    const auto found = entries_.find(groom);
    return found == entries_.end() ? std::nullopt : std::optional(found->second.file);
  }
  // The session is lost. Returns the files that were announced.
  std::vector<wire::GroomHash> clear() {
    std::vector<wire::GroomHash> files;
    for (const auto& [groom, entry] : entries_) files.push_back(entry.file);
    entries_.clear();
    return files;
  }

 private:
  // The time between two requests for one file: a server that has too much to send refuses requests meanwhile.
  static constexpr std::int64_t kAskAgain_ns = 2'000'000'000;
  struct Entry {
    wire::GroomHash file{};
    std::shared_ptr<const Known> known;
    // The file has arrived and cannot be decoded, so it is not requested again.
    bool is_unusable = false;
    // The time of the last request.
    std::optional<std::int64_t> asked_ns;
  };
  std::shared_ptr<KnownFiles<Known>> known_;
  // Turns the bytes of a file into a Known.
  Decode decode_;
  // What is known of the file of each groom.
  std::map<wire::GroomHash, Entry> entries_;
};

using Bases = GroomFiles<KnownBasis>;
using LearntHairs = GroomFiles<LearntHair>;

}  // namespace hairnet::link
