#include "client/link/groom_fetch.hpp"

#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "schema/wire/groom_file.hpp"

namespace hairnet::link {

GroomFetch::Progress GroomFetch::progress() const {
  Progress progress{arrived_bytes_, arrived_bytes_};
  for (const auto& [hash, fetch] : fetches_) {
    progress.bytes += fetch.bytes.size();
    progress.byte_count += fetch.byte_count;
  }
  return progress;
}

std::optional<wire::GroomRequest> GroomFetch::request(const wire::GroomHash& hash) {
  if (fetches_.empty()) arrived_bytes_ = 0;
  if (!fetches_.try_emplace(hash).second) return std::nullopt;
  return wire::GroomRequest{hash, 0};
}

std::vector<wire::GroomRequest> GroomFetch::request_again() const {
  std::vector<wire::GroomRequest> requests;
  for (const auto& [hash, fetch] : fetches_) requests.push_back({hash, fetch.bytes.size()});
  return requests;
}

std::optional<GroomFetched> GroomFetch::take(const wire::GroomData& data) {
  const auto found = fetches_.find(data.hash);
  if (found == fetches_.end()) return std::nullopt;  // refused or cancelled meanwhile
  std::vector<std::uint8_t>& bytes = found->second.bytes;
  if (data.byte_count > wire::kGroomBytesMax) return fail(data.hash, "larger than a groom may be");
  // Memory grows by the bytes that arrive, and not by the size that the server states.
  if (data.offset > bytes.size() || bytes.size() > data.byte_count || data.bytes.size() > data.byte_count - data.offset)
    return fail(data.hash, "its pieces do not fit together");
  // Pieces of a download that was given up may come after the request was repeated.
  const std::size_t repeated = std::min<std::size_t>(bytes.size() - data.offset, data.bytes.size());
  bytes.insert(bytes.end(), data.bytes.begin() + static_cast<std::ptrdiff_t>(repeated), data.bytes.end());
  HAIRNET_ASSERT(bytes.size() <= data.byte_count);
  found->second.byte_count = data.byte_count;
  if (bytes.size() < data.byte_count) return std::nullopt;
  // The hash shows bytes that were damaged on the way, on the server's disk, or on purpose.
  if (wire::hash_groom(bytes) != data.hash) return fail(data.hash, "its bytes are not those of its hash");
  arrived_bytes_ += bytes.size();
  GroomFetched fetched{data.hash, std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes)), {}};
  fetches_.erase(found);
  return fetched;
}

GroomFetched GroomFetch::fail(const wire::GroomHash& hash, std::string error) {
  HAIRNET_ASSERT(!error.empty());
  fetches_.erase(hash);
  return {hash, nullptr, std::move(error)};
}

}  // namespace hairnet::link
