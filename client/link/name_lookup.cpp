#include "client/link/name_lookup.hpp"

#include <boost/asio.hpp>
#include <string>

namespace hairnet::link {

using boost::system::error_code;

// Lives until the system's call has ended.
struct NameLookup::State {
  explicit State(const asio::any_io_executor& executor)
      : resolver(executor), done(executor, asio::steady_timer::time_point::max()) {}
  asio::ip::tcp::resolver resolver;
  // find() waits on it; it is cancelled when the system's call is done.
  asio::steady_timer done;
  Found found;
  error_code error;
  bool is_cancelled = false;
};

NameLookup::NameLookup(const asio::any_io_executor& executor) : state_(std::make_shared<State>(executor)) {}

asio::awaitable<NameLookup::Found> NameLookup::find(const Address& address, error_code& error) {
  const auto state = state_;
  if (!state->is_cancelled) {
    state->resolver.async_resolve(address.host, std::to_string(address.port),
                                  [state](const error_code& failure, Found found) {
                                    // After cancel() nobody waits for the answer; this handler only keeps the state
                                    // alive.
                                    if (state->is_cancelled) return;
                                    state->error = failure;
                                    state->found = std::move(found);
                                    state->done.cancel();
                                  });
    error_code ignored;
    co_await state->done.async_wait(asio::redirect_error(asio::use_awaitable, ignored));
  }
  error = state->is_cancelled ? error_code(asio::error::operation_aborted) : state->error;
  co_return state->found;
}

void NameLookup::cancel() {
  state_->is_cancelled = true;
  state_->resolver.cancel();
  state_->done.cancel();
}

}  // namespace hairnet::link
