#include "server/objects/s3_signature.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace hairnet::server {
namespace {

using testing::EndsWith;
using testing::HasSubstr;

// The key and the date of AWS's examples.
const S3Keys kKeys{"AKIAIOSFODNN7EXAMPLE", "wJalrXUtnFEMI/K7MDENG/bPxRfiCYEXAMPLEKEY"};
constexpr const char* kDate = "20130524T000000Z";

std::string sha256_of(std::string_view text) {
  return sha256_hex({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
}

// The examples of AWS's page on signatures in the header Authorization, "Examples: Signature Calculations".
TEST(S3Signature, is_that_of_awss_example_of_get_object) {
  const std::string empty = sha256_of("");
  EXPECT_EQ(empty, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  const std::string made = s3_authorization({.method = "GET",
                                             .path = "/test.txt",
                                             .fields = {{"host", "examplebucket.s3.amazonaws.com"},
                                                        {"range", "bytes=0-9"},
                                                        {"x-amz-content-sha256", empty},
                                                        {"x-amz-date", kDate}},
                                             .payload_hash = empty},
                                            kKeys, "us-east-1", kDate);
  EXPECT_EQ(made,
            "AWS4-HMAC-SHA256 Credential=AKIAIOSFODNN7EXAMPLE/20130524/us-east-1/s3/aws4_request,"
            "SignedHeaders=host;range;x-amz-content-sha256;x-amz-date,"
            "Signature=f0e8bdb87c964420e857bd35b5d6ed310bd44f0170aba48dd91039c6036bdb41");
}

TEST(S3Signature, is_that_of_awss_example_of_put_object) {
  const std::string hash = sha256_of("Welcome to Amazon S3.");
  EXPECT_EQ(hash, "44ce7dd67c959e0d3524ffac1771dfbba87d2b6b4b4e99e42034a8b803f8b072");
  const std::string made = s3_authorization({.method = "PUT",
                                             .path = "/test%24file.text",
                                             .fields = {{"date", "Fri, 24 May 2013 00:00:00 GMT"},
                                                        {"host", "examplebucket.s3.amazonaws.com"},
                                                        {"x-amz-content-sha256", hash},
                                                        {"x-amz-date", kDate},
                                                        {"x-amz-storage-class", "REDUCED_REDUNDANCY"}},
                                             .payload_hash = hash},
                                            kKeys, "us-east-1", kDate);
  EXPECT_THAT(made, HasSubstr("SignedHeaders=date;host;x-amz-content-sha256;x-amz-date;x-amz-storage-class,"));
  EXPECT_THAT(made, EndsWith("Signature=98ad721746da40c64f1a55b78f14c238d841ea1380cd77a1b5971af0ece108bd"));
}

TEST(S3Signature, covers_every_part_of_a_request) {
  const auto sign = [](const char* method, const char* path, const char* host, const char* payload, const char* region,
                       const char* date, const char* secret) {
    return s3_authorization({.method = method, .path = path, .fields = {{"host", host}}, .payload_hash = payload},
                            {"id", secret}, region, date);
  };
  // Each line below changes one argument: the method, path, host, hash of the payload, region, date or secret. A part
  // that the signature did not cover could be changed on the way.
  const std::string one = sign("GET", "/a", "h", "p", "r", kDate, "s");
  EXPECT_EQ(sign("GET", "/a", "h", "p", "r", kDate, "s"), one);
  EXPECT_NE(sign("PUT", "/a", "h", "p", "r", kDate, "s"), one);
  EXPECT_NE(sign("GET", "/b", "h", "p", "r", kDate, "s"), one);
  EXPECT_NE(sign("GET", "/a", "i", "p", "r", kDate, "s"), one);
  EXPECT_NE(sign("GET", "/a", "h", "q", "r", kDate, "s"), one);
  EXPECT_NE(sign("GET", "/a", "h", "p", "t", kDate, "s"), one);
  EXPECT_NE(sign("GET", "/a", "h", "p", "r", "20130524T000001Z", "s"), one);
  EXPECT_NE(sign("GET", "/a", "h", "p", "r", kDate, "t"), one);
  EXPECT_EQ(one.find("\n"), std::string::npos);
}

TEST(S3Signature, writes_dates_in_utc) {
  EXPECT_EQ(s3_date(0), "19700101T000000Z");
  EXPECT_EQ(s3_date(1369353600), kDate);
  EXPECT_EQ(s3_date(1709251199), "20240229T235959Z");
}

}  // namespace
}  // namespace hairnet::server
