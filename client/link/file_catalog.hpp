#pragma once

#include <map>
#include <memory>
#include <utility>

#include "client/link/known_basis.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Decoded files of one kind. Each is here as long as a LinkCore holds it. One thread.
template <class Known>
class KnownFiles {
 public:
  // Returns null when no core has the file.
  [[nodiscard]] std::shared_ptr<const Known> find(const wire::GroomHash& file) const {
    const auto found = files_.find(file);
    return found == files_.end() ? nullptr : found->second.lock();
  }
  // Returns the copy that is here already, or stores this one. The references here are weak, so that a file is freed
  // with the last core that uses it.
  std::shared_ptr<const Known> keep(const wire::GroomHash& file, Known decoded) {
    if (std::shared_ptr<const Known> known = find(file)) return known;
    std::erase_if(files_, [](const auto& f) { return f.second.expired(); });
    auto known = std::make_shared<const Known>(std::move(decoded));
    files_[file] = known;
    return known;
  }

 private:
  // Files by the hash of their bytes.
  std::map<wire::GroomHash, std::weak_ptr<const Known>> files_;
};

// What all LinkCores of one thread share: cores that need the same file share one copy.
struct FileCatalog {
  KnownFiles<KnownBasis> bases;
  KnownFiles<LearntHair> learnt;
};

}  // namespace hairnet::link
