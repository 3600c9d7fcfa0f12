#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/result.hpp"
#include "server/objects/object_counters.hpp"
#include "server/objects/object_store.hpp"
#include "server/objects/s3_signature.hpp"
#include "server/transport/s3_endpoint.hpp"

namespace hairnet::server {

class BlockingHttpClient;
class S3Store;

// The object store that this server shares with others, and its connection. The destructor does not end a call under
// way: cancel() of the store does, before the threads are joined.
class SharedObjects {
 public:
  // Null without a store; the error is one line. Reads the files that the options name, and the environment. The
  // counters must outlive it. `now_ns` is monotonic.
  static Result<std::unique_ptr<SharedObjects>> create(const S3Options& options, ObjectCounters& counters,
                                                       std::function<std::int64_t()> now_ns);
  ~SharedObjects();
  SharedObjects(const SharedObjects&) = delete;
  SharedObjects& operator=(const SharedObjects&) = delete;

  [[nodiscard]] ObjectStore& store();

 private:
  SharedObjects();

  std::unique_ptr<BlockingHttpClient> client_;
  std::unique_ptr<S3Store> store_;
};

// The access key and the secret: of a file of two lines, or of the environment, which `variable` reads (null: not set).
Result<S3Keys> read_s3_keys(const std::string& file, const std::function<const char*(const char*)>& variable);

}  // namespace hairnet::server
