#pragma once

#include <map>
#include <memory>
#include <utility>

#include "schema/codec/frame.hpp"
#include "schema/wire/basis_file.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The data for decoding frames of a groom. Immutable.
struct KnownBasis {
  explicit KnownBasis(wire::HairBasis b) : hair(std::move(b)), code(hair.basis.deviation_m) {}
  wire::HairBasis hair;
  codec::CoefficientCode code;
};

// The bases that all LinkCores of one thread share: cores that need the same file share one copy. One thread.
class BasisCatalog {
 public:
  // Null: no core has it.
  [[nodiscard]] std::shared_ptr<const KnownBasis> find(const wire::GroomHash& file) const;
  // The one that is kept already, if there is one.
  std::shared_ptr<const KnownBasis> keep(const wire::GroomHash& file, wire::HairBasis basis);

 private:
  std::map<wire::GroomHash, std::weak_ptr<const KnownBasis>> bases_;  // by the hash of the file
};

}  // namespace hairnet::link
