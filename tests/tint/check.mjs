// Shows WGSL files to Tint: node check.mjs a.wgsl b.wgsl ...
// Prints `error FILE:LINE:COLUMN: MESSAGE` for every error, and `checked N` at the end; Dawn adds lines of its own
// with warnings. Exit code 0 unless it could not judge.
// Dawn's null back end compiles as a browser would, and needs no GPU.
import { readFileSync } from 'node:fs';
import { create, globals } from 'webgpu';

Object.assign(globalThis, globals);
// Dawn dies in the middle of its work when this object is collected: it is used again below.
const gpu = create(['backend=null']);
const adapter = await gpu.requestAdapter();
const device = await adapter.requestDevice();
const files = process.argv.slice(2);
for (const file of files) {
  device.pushErrorScope('validation');
  const shader = device.createShaderModule({ code: readFileSync(file, 'utf8') });
  const { messages } = await shader.getCompilationInfo();
  const failure = await device.popErrorScope();
  const errors = messages.filter((message) => message.type === 'error');
  for (const { lineNum, linePos, message } of errors) {
    console.log(`error ${file}:${lineNum}:${linePos}: ${message.replaceAll('\n', ' ')}`);
  }
  if (failure && errors.length === 0) {
    console.log(`error ${file}:0:0: ${failure.message.replaceAll('\n', ' ')}`);
  }
}
console.log(`checked ${files.length}`);
// Dawn would keep the process alive.
process.exit(gpu ? 0 : 1);
