// Ending at the user's wish: a signal is noted, and work asks for it at its next step.
#pragma once

namespace dyxel {

// From now on SIGINT and SIGTERM make ThrowIfInterrupted() throw, and say so on stderr; a second
// one ends the program at once. Call once, from main().
void HandleInterrupts();

// Throws Error(kInterrupted) once a signal has come. Every ProgressBar asks at each update.
void ThrowIfInterrupted();

namespace internal {
void SetInterrupted(bool interrupted);  // for tests
}

}  // namespace dyxel
