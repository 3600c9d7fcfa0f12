#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/link/basis_catalog.hpp"
#include "client/link/events.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The bases of grooms, as the server announced them and as they have arrived. One thread.
class Bases {
 public:
  // Asserts that `catalog` is not null.
  explicit Bases(std::shared_ptr<BasisCatalog> catalog);

  // The server announces the same basis again over each connection. Another one replaces the basis that is here: its
  // coefficients mean other shapes.
  void announce(const wire::GroomBasis& announced);
  // The file to ask for, once a frame needs it: none while the basis is here, cannot be used, was not announced, or was
  // asked for a moment ago.
  std::optional<wire::GroomHash> wanted(const wire::GroomHash& groom, std::int64_t now_ns);
  // The grooms whose basis the file of this hash is.
  [[nodiscard]] std::vector<wire::GroomHash> grooms_of(const wire::GroomHash& file) const;
  // Takes the file of a basis, which several grooms may have. Returns why it cannot be used; empty: it can.
  std::string take(const GroomFetched& fetched);
  // Null: not here.
  [[nodiscard]] std::shared_ptr<const KnownBasis> of(const wire::GroomHash& groom) const;
  // The skin of the groom's body; null: its basis is not here.
  [[nodiscard]] std::shared_ptr<const Skin> skin_of(const wire::GroomHash& groom) const;
  // The session is lost. Returns the files that were announced.
  std::vector<wire::GroomHash> clear();

 private:
  struct Entry {
    wire::GroomHash file{};
    std::shared_ptr<const KnownBasis> basis;
    bool is_unusable = false;
    std::optional<std::int64_t> asked_ns;
  };
  std::shared_ptr<BasisCatalog> catalog_;
  std::map<wire::GroomHash, Entry> entries_;  // by groom
};

}  // namespace hairnet::link
