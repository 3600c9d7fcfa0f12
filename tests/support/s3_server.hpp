#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace hairnet::support {

// How the server answers requests. Each value but `right` is a failure that a client of S3 must survive.
enum class S3Behaviour : std::uint8_t {
  right,
  // The answer is 403 AccessDenied.
  denied,
  // The answer is 500 InternalError.
  error,
  // The answer is 301, with a location on another host.
  redirect,
  // The answer is 404 NoSuchBucket. A client must not take it for a missing object, which is 404 NoSuchKey.
  no_bucket,
  // The request is read, and no answer follows.
  silent,
  // The answer announces 1 TB, which is more than any object has.
  too_large,
  // The connection ends after 3 of the 100 bytes that the answer announces.
  truncated,
  // One bit of the object's middle byte is wrong.
  lying,
  // The answer is the greeting of a mail server.
  no_http,
  // The answer is right, but the connection ends after it, without "Connection: close".
  closes_idle,
  // The answer is 403 before the request's body is read, and the connection ends.
  refuses_at_once,
  // The answer is 500 and announces 1 GB of body, of which 3 bytes come.
  endless_error,
};

struct S3ServerDef {
  std::string bucket = "bucket", access = "test-access", secret = "test-secret", region = "us-east-1";
  // Paths of PEM files. Without them the server speaks plain HTTP.
  std::string certificate = {}, key = {};
  // A fixed port lets a test stop a server and start another one at the same address. Zero means any free port.
  std::uint16_t port = 0;
};

// As much of S3 as a store of objects needs, in memory, on a port of the loopback and a thread of its own. It checks
// the signature of each request as AWS describes it, with OpenSSL: nothing of the server's own code is in it.
class S3Server {
 public:
  explicit S3Server(S3ServerDef def = {});
  ~S3Server();
  S3Server(const S3Server&) = delete;
  S3Server& operator=(const S3Server&) = delete;

  [[nodiscard]] std::uint16_t port() const { return port_; }
  [[nodiscard]] std::string host() const { return "127.0.0.1:" + std::to_string(port_); }
  [[nodiscard]] std::string url(const std::string& prefix = "") const;
  // Returns the objects by their names, which begin after the bucket.
  [[nodiscard]] std::map<std::string, std::vector<std::uint8_t>> objects() const;
  void set_object(const std::string& name, std::vector<std::uint8_t> bytes);

  // The test's thread may change the behaviour at any time; it holds from the next request on.
  std::atomic<S3Behaviour> behaviour = S3Behaviour::right;
  // The counts since the start. `gets`, `heads` and `puts` leave out requests that `refuses_at_once` has answered.
  std::atomic<std::size_t> connections = 0, gets = 0, heads = 0, puts = 0;
  // The number of requests that wrong_with() (s3_server.cpp) has refused.
  std::atomic<std::size_t> wrong_signatures = 0;

 private:
  // The sockets and their event loop, which `thread_` runs.
  struct Impl;
  S3ServerDef def_;
  std::unique_ptr<Impl> impl_;
  std::uint16_t port_ = 0;
  // Guards the objects.
  mutable std::mutex mutex_;
  std::map<std::string, std::vector<std::uint8_t>> objects_;
  std::thread thread_;
};

}  // namespace hairnet::support
