#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hairnet::server {

// Where the objects of a fleet are, and how this server shows who it is.
struct S3Options {
  // Names the folder of objects, http:// or https://. Bucket in the path: https://host[:port]/bucket[/prefix]; or in
  // the name: https://bucket.host[/prefix]. Empty: there is no object store.
  std::string url = {};
  std::string region = "us-east-1";
  // A file with two lines, the access key and the secret; empty: the environment has them.
  std::string key_file = {};
  // The store's certificate must follow from this PEM file; empty: from the system's.
  std::string ca = {};
};

struct S3Endpoint {
  // A name or a numeric address, without brackets.
  std::string host;
  std::uint16_t port = 0;
  bool is_tls = false;
  // The value of the header field Host.
  std::string host_field;
  // Comes before the name of each object; begins and ends with a slash.
  std::string path;
};

Result<S3Endpoint> parse_s3_endpoint(std::string_view url);

// Returns an empty string when the options agree with each other; else one line. Reads no file.
std::string validate(const S3Options& options);

}  // namespace hairnet::server
