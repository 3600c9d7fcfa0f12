#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hairnet::server {

// Where the objects of a fleet are, and how this server shows who it is.
struct S3Options {
  // Of the folder of objects, http:// or https://. Bucket in the path: https://host[:port]/bucket[/prefix]; or in the
  // name: https://bucket.host[/prefix]. Empty: there is no object store.
  std::string url = {};
  std::string region = "us-east-1";
  std::string key_file = {};  // two lines, access key and secret; empty: the environment has them
  std::string ca = {};        // PEM file that the store's certificate must follow from; empty: the system's
};

struct S3Endpoint {
  std::string host;  // a name or a numeric address, without brackets
  std::uint16_t port = 0;
  bool is_tls = false;
  std::string host_field;  // of the header
  std::string path;        // before the name of each object; begins and ends with a slash
};

Result<S3Endpoint> parse_s3_endpoint(std::string_view url);

// Returns an empty string when the options agree with each other; else one line. Reads no file.
std::string validate(const S3Options& options);

}  // namespace hairnet::server
