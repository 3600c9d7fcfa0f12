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
    read,         // get: `bytes` has the object
    stored,       // put
    kept,         // put: an object of that name was there
    absent,       // get
    too_large,    // get: the object has more bytes than were asked for
    unreachable,  // no answer, a broken one, an error of the store, or it is left alone after one
    refused,      // the store does not accept the request: a wrong key, bucket or region
  };
  Outcome outcome = Outcome::absent;
  std::vector<std::uint8_t> bytes;
  std::string reason;  // one line, when too_large, unreachable or refused
};

// Objects by name, which the servers of a fleet share. Its content is foreign: callers check what they read. get() and
// put() wait for the store, but no longer than its time-outs, and may be called from several threads.
class ObjectStore {
 public:
  enum class Existing : std::uint8_t { keep, replace };

  virtual ~ObjectStore() = default;
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
