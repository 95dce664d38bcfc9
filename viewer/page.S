// Embeds the bundled web UI (viewer/page/) in the program.
        .section .rodata
        .global tessera_page_begin
        .global tessera_page_end
tessera_page_begin:
        .incbin "page.html.gz"
tessera_page_end:
        .section .note.GNU-stack,"",@progbits
