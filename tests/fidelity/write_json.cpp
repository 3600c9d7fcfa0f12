#include "tests/fidelity/write_json.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>

#include "client/files/write_file.hpp"

namespace hairnet::fidelity {

int fail(const std::string& reason) {
  std::fprintf(stderr, "hairnet-fidelity: %s\n", reason.c_str());
  return 1;
}

int write_json(const std::string& path, const nlohmann::ordered_json& rows) {
  if (path.empty()) return 0;
  const std::string text = rows.dump(1) + "\n";
  const Result<void> written = write_file(path, std::as_bytes(std::span(text)));
  return written ? 0 : fail(path + ": " + written.error());
}

}  // namespace hairnet::fidelity
