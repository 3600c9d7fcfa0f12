#include "client/link/level_catalog.hpp"

#include "core/assert.hpp"

namespace hairnet::link {
namespace {

bool is_same(const LevelGeometry& a, const LevelGeometry& b) {
  return a.lattice.origin == b.lattice.origin && a.lattice.spacing == b.lattice.spacing &&
         a.lattice.dims == b.lattice.dims && a.active_nodes == b.active_nodes && a.trimmed_nodes == b.trimmed_nodes &&
         a.trimmed_begin == b.trimmed_begin && a.trimmed_from == b.trimmed_from &&
         a.trimmed_weights == b.trimmed_weights;
}

}  // namespace

std::shared_ptr<const KnownLevel> LevelCatalog::keep(wire::LevelRecord record) {
  HAIRNET_ASSERT(record.level != LevelIndex::rigid);
  HAIRNET_VALIDATE(validate(record.geometry).empty());
  std::weak_ptr<const KnownLevel>& kept = levels_[{record.groom, record.level}];
  if (std::shared_ptr<const KnownLevel> known = kept.lock(); known && is_same(known->geometry, record.geometry))
    return known;
  auto known = std::make_shared<const KnownLevel>(std::move(record.geometry));
  kept = known;  // another server may build the level differently: the new record wins
  std::erase_if(levels_, [](const auto& level) { return level.second.expired(); });
  return known;
}

}  // namespace hairnet::link
