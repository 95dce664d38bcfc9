// What a process does with memory that it frees.
#pragma once

namespace tessera {

// Has the C library keep freed memory for what is allocated next. A tick frees what the next one wants again;
// to hand it to the kernel in between costs a page fault for every 4 kB, a third of the time of a tick. Of
// the whole process: a program calls it once, before it starts threads.
void keep_freed_memory();

// Has it hand large blocks to the kernel as soon as they are freed, and threads share what it keeps of small
// ones: for a process through which messages and states pass, on many threads. Also called once, at first.
void return_freed_memory();

// Hands to the kernel what is kept, where much has been freed that will not be wanted soon. Takes some
// milliseconds a gigabyte.
void give_back_freed_memory();

}  // namespace tessera
