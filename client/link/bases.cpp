#include "client/link/bases.hpp"

#include <algorithm>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

// Between two requests for one basis: a server that sends too much already refuses.
constexpr std::int64_t kAskAgain_ns = 2'000'000'000;

}  // namespace

void Bases::announce(const wire::GroomBasis& announced) {
  Entry& entry = entries_[announced.groom];
  if (entry.file != announced.basis) entry = {announced.basis, nullptr, false, std::nullopt};
}

std::optional<wire::GroomHash> Bases::wanted(const wire::GroomHash& groom, std::int64_t now_ns) {
  const auto found = entries_.find(groom);
  if (found == entries_.end()) return std::nullopt;
  Entry& entry = found->second;
  if (entry.basis || entry.is_unusable) return std::nullopt;
  if (entry.asked_ns && now_ns - *entry.asked_ns < kAskAgain_ns) return std::nullopt;
  entry.asked_ns = now_ns;
  return entry.file;
}

std::optional<wire::GroomHash> Bases::groom_of(const wire::GroomHash& file) const {
  const auto found = std::ranges::find(entries_, file, [](const auto& entry) { return entry.second.file; });
  return found == entries_.end() ? std::nullopt : std::optional(found->first);
}

std::string Bases::take(const wire::GroomHash& groom, const GroomFetched& fetched) {
  Entry& entry = entries_.at(groom);
  HAIRNET_ASSERT(entry.file == fetched.hash);
  if (!fetched.bytes) return fetched.fault;
  Result<wire::HairBasis> decoded = wire::decode_basis(*fetched.bytes);
  entry.is_unusable = !decoded;
  if (!decoded) return decoded.error();
  entry.basis = std::make_shared<const KnownBasis>(std::move(*decoded));
  return {};
}

std::shared_ptr<const KnownBasis> Bases::of(const wire::GroomHash& groom) const {
  const auto found = entries_.find(groom);
  return found == entries_.end() ? nullptr : found->second.basis;
}

std::vector<wire::GroomHash> Bases::clear() {
  std::vector<wire::GroomHash> files;
  for (const auto& [groom, entry] : entries_) files.push_back(entry.file);
  entries_.clear();
  return files;
}

}  // namespace hairnet::link
