#include "tests/fidelity/write_json.hpp"

#include <cstdio>
#include <nlohmann/json.hpp>
#include <span>

#include "client/files/write_file.hpp"

namespace hairnet::fidelity {

int write_json(const char* program, const std::string& path, const nlohmann::ordered_json& rows) {
  if (path.empty()) return 0;
  const std::string text = rows.dump(1) + "\n";
  const Result<void> written = write_file(path, std::as_bytes(std::span(text)));
  if (written) return 0;
  std::fprintf(stderr, "%s: %s: %s\n", program, path.c_str(), written.error().c_str());
  return 1;
}

}  // namespace hairnet::fidelity
