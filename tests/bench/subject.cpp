#include "tests/bench/subject.hpp"

#include <utility>

#include "tests/support/corpus.hpp"

namespace hairnet::bench {

Result<Subject> load_subject(const Options& options) {
  auto groom = fidelity::load_groom(options.groom);
  if (!groom) return Refusal(groom.error());
  Subject subject{std::move(*groom), {}};
  for (const std::string& name : options.motions) {
    auto motion = fidelity::load_motion(name, subject.groom.body);
    if (!motion) return Refusal(motion.error());
    subject.motions.push_back(std::move(*motion));
  }
  return subject;
}

}  // namespace hairnet::bench
