#include "client/link/bases.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

// Between two requests for one basis: a server that sends too much already refuses.
constexpr std::int64_t kAskAgain_ns = 2'000'000'000;

}  // namespace

Bases::Bases(std::shared_ptr<BasisCatalog> catalog) : catalog_(std::move(catalog)) {
  HAIRNET_ASSERT(catalog_);
}

void Bases::announce(const wire::GroomBasis& announced) {
  Entry& entry = entries_[announced.groom];
  if (entry.file != announced.basis) entry = {announced.basis, catalog_->find(announced.basis), false, std::nullopt};
}

std::optional<wire::GroomHash> Bases::wanted(const wire::GroomHash& groom, std::int64_t now_ns) {
  const auto found = entries_.find(groom);
  if (found == entries_.end()) return std::nullopt;
  Entry& entry = found->second;
  if (!entry.basis) entry.basis = catalog_->find(entry.file);
  if (entry.basis || entry.is_unusable) return std::nullopt;
  if (entry.asked_ns && now_ns - *entry.asked_ns < kAskAgain_ns) return std::nullopt;
  entry.asked_ns = now_ns;
  return entry.file;
}

std::vector<wire::GroomHash> Bases::grooms_of(const wire::GroomHash& file) const {
  std::vector<wire::GroomHash> grooms;
  for (const auto& [groom, entry] : entries_) {
    if (entry.file == file) grooms.push_back(groom);
  }
  return grooms;
}

std::string Bases::take(const GroomFetched& fetched) {
  if (!fetched.bytes) return fetched.fault;
  Result<wire::HairBasis> decoded = wire::decode_basis(*fetched.bytes);
  const auto basis = decoded ? catalog_->keep(fetched.hash, std::move(*decoded)) : nullptr;
  for (auto& [groom, entry] : entries_) {
    if (entry.file != fetched.hash) continue;
    entry.basis = basis;
    entry.is_unusable = !basis;
  }
  return decoded ? std::string() : decoded.error();
}

std::shared_ptr<const KnownBasis> Bases::of(const wire::GroomHash& groom) const {
  const auto found = entries_.find(groom);
  return found == entries_.end() ? nullptr : found->second.basis;
}

std::shared_ptr<const Skin> Bases::skin_of(const wire::GroomHash& groom) const {
  const std::shared_ptr<const KnownBasis> basis = of(groom);
  return basis ? std::shared_ptr<const Skin>(basis, &basis->hair.skin) : nullptr;
}

std::vector<wire::GroomHash> Bases::clear() {
  std::vector<wire::GroomHash> files;
  for (const auto& [groom, entry] : entries_) files.push_back(entry.file);
  entries_.clear();
  return files;
}

}  // namespace hairnet::link
