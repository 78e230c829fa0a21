// Shows WGSL files to Tint: node check.mjs a.wgsl b.wgsl ...
// Prints `FILE:LINE:COLUMN: MESSAGE` for every error, and `checked N` at the end; exit code 0 unless it could not judge.
// Dawn's null back end compiles as a browser would, and needs no GPU.
import { readFileSync } from 'node:fs';
import { create, globals } from 'webgpu';

Object.assign(globalThis, globals);
const adapter = await create(['backend=null']).requestAdapter();
const device = await adapter.requestDevice();
const files = process.argv.slice(2);
for (const file of files) {
  device.pushErrorScope('validation');
  const shader = device.createShaderModule({ code: readFileSync(file, 'utf8') });
  const { messages } = await shader.getCompilationInfo();
  const failure = await device.popErrorScope();
  const errors = messages.filter((message) => message.type === 'error');
  for (const { lineNum, linePos, message } of errors) {
    console.log(`${file}:${lineNum}:${linePos}: ${message.replaceAll('\n', ' ')}`);
  }
  if (failure && errors.length === 0) {
    console.log(`${file}:0:0: ${failure.message.replaceAll('\n', ' ')}`);
  }
}
console.log(`checked ${files.length}`);
// Dawn's device would keep the process alive.
process.exit(0);
