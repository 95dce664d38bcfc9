// A transform of the AssemblyScript compiler (--transform): the comment of the source that begins with "TESSERA_PROGRAM"
// becomes the description of the program, as the macro of that name in tessera/program.h does in C.

export default class {
  afterParse(parser) {
    for (const source of parser.sources) {
      const comment = /\/\* TESSERA_PROGRAM\n(.*?)\*\//s.exec(source.text);
      if (comment) this.description = comment[1];
    }
  }

  afterCompile(module) {
    if (!this.description) throw new Error("no comment begins with TESSERA_PROGRAM");
    module.addCustomSection("tessera", new TextEncoder().encode(this.description));
  }
}
