#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hairnet::server {

// The answer of an object store.
struct ObjectAnswer {
  enum class Outcome : std::uint8_t {
    // A get has brought the object in `bytes`.
    read,
    // A put has written the object.
    stored,
    // A put has found an object of that name, and left it.
    kept,
    // A get has found no object of that name.
    absent,
    // The object has more bytes than the get asked for.
    too_large,
    // There is no answer, a broken one or an error of the store, or the store is left alone after one.
    unreachable,
    // The store does not accept the request: a wrong key, bucket or region.
    refused,
  };
  Outcome outcome = Outcome::absent;
  std::vector<std::uint8_t> bytes;
  // One line, when too_large, unreachable or refused.
  std::string reason;
};

// Objects by name, which the servers of a fleet share. Its content is foreign: callers check what they read. get() and
// put() wait for the store, but no longer than its time-outs, and may be called from several threads.
class ObjectStore {
 public:
  // Whether put() leaves an object of that name, which saves sending it again, or replaces it.
  enum class Existing : std::uint8_t { keep, replace };

  virtual ~ObjectStore() = default;
  // Reads an object of at most `bytes_max` bytes. The bound limits the memory that an object of another writer may
  // take.
  [[nodiscard]] virtual ObjectAnswer get(std::string_view name, std::size_t bytes_max) = 0;
  [[nodiscard]] virtual ObjectAnswer put(std::string_view name, std::span<const std::uint8_t> bytes,
                                         Existing existing) = 0;
  // False while the store is left alone after a failure: such calls fail at once. Any thread.
  [[nodiscard]] virtual bool takes_gets() const = 0;
  [[nodiscard]] virtual bool takes_puts() const = 0;
  // Ends the call under way soon, and every later one at once. Any thread.
  virtual void cancel() = 0;
};

}  // namespace hairnet::server
