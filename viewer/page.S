// The page in the program: what the folder page/ was bundled to.
        .section .rodata
        .global tessera_page_begin
        .global tessera_page_end
tessera_page_begin:
        .incbin "page.html.gz"
tessera_page_end:
        .section .note.GNU-stack,"",@progbits
