/** Shaders in short: the common parts of all materials of the canvas. */

import { GLSL3, RawShaderMaterial, type IUniform } from "three";

const HEAD = `precision highp float;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
`;

export interface Shader {
  vertex: string;
  fragment: string;
  uniforms: Record<string, IUniform>;
  /** Whether nearer things cover farther ones. */
  depth: boolean;
  /** Whether things behind shine through. */
  transparent: boolean;
}

export function material({ vertex, fragment, uniforms, depth, transparent }: Shader): RawShaderMaterial {
  return new RawShaderMaterial({
    glslVersion: GLSL3,
    vertexShader: HEAD + vertex,
    fragmentShader: `precision highp float;\nout vec4 color;\n${fragment}`,
    uniforms,
    depthTest: depth,
    depthWrite: depth && !transparent,
    transparent,
  });
}
