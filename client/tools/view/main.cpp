#include <cstdio>
#include <string>

#include "client/tools/view/cast.hpp"
#include "client/tools/view/options.hpp"
#include "client/tools/view/pictures.hpp"
#include "client/tools/view/stream.hpp"

namespace {

using namespace hairnet;
using namespace hairnet::viewer;

Result<void> run(const ViewOptions& options) {
  std::unique_ptr<Pictures> pictures;
  std::vector<double> moment_times_s;
  if (!options.sheet.empty()) moment_times_s = options.times_s;
  if (!options.out.empty()) moment_times_s.push_back(options.duration_s + options.settle_s);
  if (!moment_times_s.empty()) {
    Result<std::unique_ptr<Pictures>> made = make_pictures();
    if (!made) return Refusal(made.error());
    pictures = std::move(*made);
  }
  const Result<std::vector<Actor>> cast = load_cast(options.characters);
  if (!cast) return Refusal(cast.error());

  const StreamResult streamed = stream(options, *cast, moment_times_s);
  std::fputs(streamed.statistics.summary().c_str(), stdout);
  if (!streamed.ended) return streamed.ended;
  return pictures ? pictures->write(options, *cast, streamed) : Result<void>();
}

}  // namespace

int main(int argc, char** argv) {
  const auto parsed = parse_options(argc, argv);
  if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
  const Result<void> done = run(std::get<ViewOptions>(parsed));
  if (done) return 0;
  std::fprintf(stderr, "hairnet-view: %s\n", done.error().c_str());
  return 1;
}
