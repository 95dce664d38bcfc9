// Ctrl-C as something to wait for, so that every command can end in order.
#pragma once

namespace tessera::cli {

// From now on SIGINT and SIGTERM set a flag instead of ending the process; a third one ends it after all.
void catch_interrupts();

// The end of the standard input counts as one, too: it comes with the end of the program that holds the other
// end of the pipe. After catch_interrupts().
void interrupt_at_end_of_input();

// Whether one has come.
bool interrupted();

// The number of the first signal that has come; 0 without one, also at the end of the input.
int interrupting_signal();

// A file descriptor that is readable from the first interrupt on; -1 before catch_interrupts().
int interrupt_descriptor();

}  // namespace tessera::cli
