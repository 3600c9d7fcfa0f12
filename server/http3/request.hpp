#pragma once

#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "schema/http3/field_section.hpp"

namespace hairnet::http3 {

// What a request's fields say, as far as it matters here.
struct Request {
  // The pseudo-fields of the request; an absent one is empty.
  std::string method, protocol, scheme, authority, path;
  // Empty: the request does not come from a page.
  std::string origin;

  // An extended CONNECT (RFC 9220) for a WebTransport session.
  [[nodiscard]] bool asks_for_session() const;
};

// One line for fields that no request may have (RFC 9114, section 4.3): a message error.
Result<Request> read_request(std::span<const Field> fields);

}  // namespace hairnet::http3
