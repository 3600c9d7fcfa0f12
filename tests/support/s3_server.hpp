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

// How the server answers: correctly, with the HTTP status behind the name, or in the wrong way that is described there.
enum class S3Behaviour : std::uint8_t {
  right,
  denied,           // 403
  error,            // 500
  redirect,         // 301
  no_bucket,        // 404 that is no missing object
  silent,           // no answer
  too_large,        // announces more bytes than any object has
  truncated,        // ends the connection in the middle of the body
  lying,            // other bytes than those of the object
  no_http,          // an answer in another language
  closes_idle,      // right, but ends each connection after its answer, without a word
  refuses_at_once,  // 403 before the request's body, and ends the connection
  endless_error,    // 500 with a long body
};

struct S3ServerDef {
  std::string bucket = "bucket", access = "test-access", secret = "test-secret", region = "us-east-1";
  std::string certificate = {}, key = {};  // PEM files; empty: no TLS
  std::uint16_t port = 0;                  // 0: any free one
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

  std::atomic<S3Behaviour> behaviour = S3Behaviour::right;
  std::atomic<std::size_t> connections = 0, gets = 0, heads = 0, puts = 0;
  std::atomic<std::size_t> wrong_signatures = 0;

 private:
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
