#include "client/link/basis_catalog.hpp"

namespace hairnet::link {

std::shared_ptr<const KnownBasis> BasisCatalog::find(const wire::GroomHash& file) const {
  const auto found = bases_.find(file);
  return found == bases_.end() ? nullptr : found->second.lock();
}

std::shared_ptr<const KnownBasis> BasisCatalog::keep(const wire::GroomHash& file, wire::HairBasis basis) {
  if (std::shared_ptr<const KnownBasis> known = find(file)) return known;
  std::erase_if(bases_, [](const auto& b) { return b.second.expired(); });
  auto known = std::make_shared<const KnownBasis>(std::move(basis));
  bases_[file] = known;
  return known;
}

}  // namespace hairnet::link
