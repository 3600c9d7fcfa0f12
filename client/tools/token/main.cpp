#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <functional>
#include <iostream>
#include <optional>

#include "client/tools/command_line/parse.hpp"
#include "client/tools/command_line/run_program.hpp"
#include "client/tools/token/commands.hpp"
#include "client/tools/token/duration.hpp"

namespace {

using namespace hairnet;

constexpr const char* kFooter = R"(Examples:
  (umask 077; hairnet-token key > token.key)
  hairnet-token make --key-file token.key --room stage --role participant --expires 12h --subject alice \
                     --characters-max 2
  hairnet-token make --key-file token.key --any-room --role observer --expires 30d --name "wall display" --id wall-7
  hairnet-token show --key-file token.key TOKEN
)";

CLI::Option* add_duration(CLI::App& app, const char* flag, std::function<void(std::int64_t)> store, const char* about) {
  return app.add_option_function<std::string>(
      flag,
      [flag, store](const std::string& text) {
        const auto seconds = token::parse_duration_s(text);
        if (!seconds) throw CLI::ValidationError(flag, "'" + text + "' is no duration like 90s, 15m, 12h or 30d");
        store(*seconds);
      },
      about);
}

void add_right(CLI::App& app, const char* flag, std::optional<bool>& right, const char* about) {
  app.add_option_function<std::string>(
         flag, [&right](const std::string& text) { right = text == "on"; }, about)
      ->check(CLI::IsMember({"on", "off"}));
}

void add_make(CLI::App& app, token::MakeOptions& o) {
  CLI::App& make = *app.add_subcommand("make", "a token for one user, on standard output");
  make.add_option("--key-file", o.key_file, "the server's key")->required();
  CLI::Option_group& where = *make.add_option_group("Room", "one of the two");
  // One of both must be given: a token for every room must be a decision.
  where.add_option_function<std::string>(
      "--room", [&o](const std::string& room) { o.claims.room = room; }, "good in this room; '' is the lobby");
  where.add_flag_callback(
      "--any-room", [&o] { o.claims.room.reset(); }, "good in every room");
  where.require_option(1);
  // Required, since neither role is a safe default.
  make.add_option_function<std::string>(
          "--role",
          [&o](const std::string& role) {
            o.claims.role = role == "observer" ? wire::Role::observer : wire::Role::participant;
          },
          "participant, or observer: without characters of its own")
      ->required()
      ->check(CLI::IsMember({"participant", "observer"}));
  add_duration(
      make, "--expires", [&o](std::int64_t s) { o.expires_s = s; }, "good for so long: 90s, 15m, 12h, 30d (1h)");
  add_duration(
      make, "--not-before", [&o](std::int64_t s) { o.not_before_s = s; }, "good only from so far in the future on");
  make.add_option_function<std::uint32_t>(
      "--characters-max", [&o](std::uint32_t n) { o.claims.characters_max = n; },
      "characters of all clients of the subject (the server's limit)");
  make.add_option_function<std::uint64_t>(
      "--strands-max", [&o](std::uint64_t n) { o.claims.strands_max = n; },
      "strands of all grooms of the subject (the server's limit)");
  make.add_option("--name", o.claims.name, "for people and logs");
  make.add_option("--subject", o.claims.subject, "whose token it is: quotas and shares count by subject (the name)");
  make.add_option("--id", o.claims.id, "names this token in the server's list of revoked tokens");
  add_right(make, "--upload", o.claims.upload, "may upload grooms (a participant may, an observer may not)");
  add_right(make, "--wind", o.claims.wind, "may set the wind of the room (as the server is set)");
  add_right(make, "--touch", o.claims.touch,
            "may touch the hair of others who allow it (a participant may, an observer may not)");
  add_right(make, "--props", o.claims.props, "may set the props of the room (as the server is set)");
  make.add_flag("--moderate", o.claims.moderate, "may remove and mute others of the room, and lock it");
}

int report(const Result<std::string>& result) {
  if (!result) {
    std::fprintf(stderr, "hairnet-token: %s\n", result.error().c_str());
    return 1;
  }
  std::printf("%s\n", result->c_str());
  return 0;
}

int run(int argc, char** argv) {
  CLI::App app("Makes keys and tokens that say who may enter which room of a hairnet-server.", "hairnet-token");
  app.footer(kFooter);
  app.require_subcommand(1);
  token::MakeOptions make;
  add_make(app, make);
  token::ShowOptions show;
  CLI::App& show_app = *app.add_subcommand("show", "what a token grants, and whether it is good now");
  show_app.add_option("--key-file", show.key_file, "the server's key")->required();
  show_app.add_option("token", show.token, "the token; without it, the first line of standard input");
  CLI::App& key_app = *app.add_subcommand("key", "a new key, on standard output: keep it as secret as a password");
  if (const auto exit_status = parse_command_line(app, argc, argv)) return *exit_status;
  const std::int64_t now_s = std::time(nullptr);
  if (key_app.parsed()) return report(token::make_key());
  if (!show_app.parsed()) return report(token::make_token(make, now_s));
  // A token on the command line is seen by all users of the machine; standard input is not.
  if (show.token.empty()) std::getline(std::cin, show.token);
  return report(token::show_token(show, now_s));
}

}  // namespace

int main(int argc, char** argv) {
  return hairnet::run_program("hairnet-token", [&] { return run(argc, argv); });
}
