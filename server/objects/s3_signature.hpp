#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hairnet::server {

// Who asks, as S3 knows it. The secret is never logged.
struct S3Keys {
  std::string access, secret;
};

// The parts of a request that AWS Signature Version 4 covers, for the service s3.
struct S3Request {
  std::string_view method;
  // The encoded path of the request; it has no query.
  std::string_view path;
  // The fields of the header, sorted, with names in lower case.
  std::vector<std::pair<std::string, std::string>> fields;
  // The SHA-256 of the body, hexadecimal.
  std::string payload_hash;
};

// SHA-256 in hexadecimal digits.
std::string sha256_hex(std::span<const std::uint8_t> bytes);

// YYYYMMDDTHHMMSSZ, as x-amz-date has it.
std::string s3_date(std::int64_t unix_time_s);

// The value of the field Authorization. `date` is that of x-amz-date, which `fields` should contain.
// https://docs.aws.amazon.com/AmazonS3/latest/API/sig-v4-header-based-auth.html
std::string s3_authorization(const S3Request& request, const S3Keys& keys, std::string_view region,
                             std::string_view date);

}  // namespace hairnet::server
